// Where a feature is expected in the image, by what there is to tell it.
#pragma once

#include "core/estimation/measurement_model.hpp"
#include "core/estimation/shared_pose.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_job.hpp"

namespace perimap {

// Where the map expects a feature at this frame's capture, the phase's deviation included; invalid without an estimate.
struct MapPrediction {
  bool valid = false;
  Vector3d p_WF = Vector3d::Zero();          // mm
  Matrix3d covariance_W = Matrix3d::Zero();  // mm^2
};

struct PixelPrediction {
  bool valid = false;
  double pose_deviation_px = 0.0;  // largest, of the part that is not the map's
  Vector2d px = Vector2d::Zero();
  Matrix2d covariance_px2 = Matrix2d::Identity();
};

// By map and tracker; where the shift that all predictions of the frame have in common is known, with that.
[[nodiscard]] PixelPrediction predict_from_map(const MapPrediction& map, const FrameRecord& frame,
                                               const PixelModel& model, const CommonShift& shift = {}) noexcept;
// As far around it as the frame says that the map is looked for.
[[nodiscard]] PixelPrediction widened(const PixelPrediction& from_map, const MapPrediction& map,
                                      const FrameRecord& frame, const PixelModel& model) noexcept;

// From the pose that the frame's matches agree on: far narrower than the tracker's where that is noisy.
[[nodiscard]] PixelPrediction predict_from_shared_pose(const MapPrediction& map, const CommonEstimate& shared,
                                                       const FrameRecord& frame, const PixelModel& model) noexcept;

// By its own motion, while it is fresh: an older velocity misleads more than it helps, the motion turns within a few
// frames.
[[nodiscard]] PixelPrediction predict_from_velocity(const FeatureSlot& slot, const FrameJob& job) noexcept;

// From where it was found last some frames ago, whatever has moved since.
[[nodiscard]] PixelPrediction predict_from_last_place(const FeatureSlot& slot, const FrameJob& job) noexcept;

// Where the features around it say that it has moved to; each frame since it was found has added to the doubt.
[[nodiscard]] PixelPrediction predict_from_neighbours(const FeatureSlot& slot,
                                                      const NeighbourMotion::Around& neighbours,
                                                      const FrameJob& job) noexcept;

[[nodiscard]] const PixelPrediction& surer(const PixelPrediction& a, const PixelPrediction& b) noexcept;

// By so much, per axis, image motion changes from frame to frame where no map predicts it.
[[nodiscard]] double unmapped_motion_px(const FrameJob& job) noexcept;

[[nodiscard]] inline std::uint64_t frames_since_found(const FeatureSlot& slot, const FrameJob& job) noexcept {
  return job.frame->index - slot.last_found_frame;
}

}  // namespace perimap
