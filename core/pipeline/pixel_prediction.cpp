#include "core/pipeline/pixel_prediction.hpp"

#include <cmath>

#include "core/geometry/symmetric_matrix2.hpp"
#include "core/pipeline/pose_noise.hpp"
#include "core/pipeline/unmapped_motion.hpp"

namespace perimap {
namespace {

// One pixel more on each axis: what the model does not know about the tissue.
Matrix2d of_the_model() noexcept { return Matrix2d::Identity(); }

}  // namespace

PixelPrediction predict_from_map(const MapPrediction& map, const FrameRecord& frame, const PixelModel& model,
                                 const CommonShift& shift) noexcept {
  if (!map.valid || !frame.measurable) return {};
  PixelPrediction prediction;
  Matrix23d J_C;
  const Vector3d p_WF = map.p_WF + frame.displacement_mm;
  if (model.camera.project(frame.X_CW * p_WF, prediction.px, &J_C) != ProjectionStatus::kOk) return {};
  prediction.px = frame.picture.to_picture(prediction.px);
  const Matrix23d J_p = frame.picture.scale.asDiagonal() * (J_C * frame.X_CW.R);
  Matrix2d of_pose;
  if (shift.known) {
    // It has the errors of pose and displacement, and its deviation what the model does not know.
    of_pose = shift.variance_at(prediction.px) * Matrix2d::Identity();
    prediction.px += shift.at(prediction.px);
  } else {
    CameraPose pose = frame.pose;
    pose.position_variance_mm2 =
        frame.tracker_variance_mm2 + frame.displacement_deviation_mm * frame.displacement_deviation_mm;
    of_pose = pose_noise_covariance(pose, p_WF, J_p) + of_the_model();
  }
  prediction.covariance_px2 = J_p * map.covariance_W * J_p.transpose() + of_pose;
  prediction.pose_deviation_px = std::sqrt(larger_eigenvalue(of_pose));
  prediction.valid = prediction.covariance_px2.allFinite();
  return prediction;
}

PixelPrediction widened(const PixelPrediction& from_map, const MapPrediction& map, const FrameRecord& frame,
                        const PixelModel& model) noexcept {
  PixelPrediction prediction = from_map;
  Vector2d px;
  Matrix23d J_C;
  if (!from_map.valid || frame.search_deviation_mm == 0.0 ||
      model.camera.project(frame.X_CW * map.p_WF, px, &J_C) != ProjectionStatus::kOk) {
    return prediction;
  }
  const Matrix23d J = frame.picture.scale.asDiagonal() * J_C;
  prediction.covariance_px2 += frame.search_deviation_mm * frame.search_deviation_mm * J * J.transpose();
  return prediction;
}

PixelPrediction predict_from_shared_pose(const MapPrediction& map, const CommonEstimate& shared,
                                         const FrameRecord& frame, const PixelModel& model) noexcept {
  PixelPrediction prediction;
  MeasurementJacobians J;
  if (measure(model, shared.X_CW, map.p_WF, prediction.px, &J) != ProjectionStatus::kOk) return {};
  prediction.px = frame.picture.to_picture(prediction.px);
  const auto scale = frame.picture.scale.asDiagonal();
  CommonJacobian J_s(2, kPoseUnknowns);
  J_s << scale * J.dz_dtheta, scale * J.dz_dc;
  const Matrix23d J_p = scale * J.dz_dp;
  prediction.covariance_px2 = J_p * map.covariance_W * J_p.transpose() +
                              common_noise(J_s, shared.covariance.topLeftCorner(kPoseUnknowns, kPoseUnknowns)) +
                              of_the_model();
  prediction.valid = prediction.covariance_px2.allFinite();
  return prediction;
}

double unmapped_motion_px(const FrameJob& job) noexcept { return kUnmappedMotion_px_per_s / job.frame->rate.per_s(); }

PixelPrediction predict_from_velocity(const FeatureSlot& slot, const FrameJob& job) noexcept {
  PixelPrediction prediction;
  prediction.valid = frames_since_found(slot, job) == 1;
  prediction.px = slot.patch_state.px + slot.velocity_px;
  const double deviation_px = unmapped_motion_px(job);
  prediction.covariance_px2 = deviation_px * deviation_px * Matrix2d::Identity();
  return prediction;
}

PixelPrediction predict_from_last_place(const FeatureSlot& slot, const FrameJob& job) noexcept {
  const std::uint64_t frames = frames_since_found(slot, job);
  PixelPrediction prediction;
  prediction.valid = frames > 1 && frames <= job.frame->rate.frames(kTrackedUnseen);
  prediction.px = slot.patch_state.px;
  const double deviation_px = unmapped_motion_px(job) * static_cast<double>(frames);
  prediction.covariance_px2 = deviation_px * deviation_px * Matrix2d::Identity();
  return prediction;
}

PixelPrediction predict_from_neighbours(const FeatureSlot& slot, const NeighbourMotion::Around& neighbours,
                                        const FrameJob& job) noexcept {
  constexpr double kStrain_px = 1.5, kDoubt_px_per_s = 15.0;
  const std::uint64_t frames = frames_since_found(slot, job);
  PixelPrediction prediction;
  prediction.valid = neighbours.known && frames <= job.frame->rate.frames(kCarriedUnseen);
  prediction.px = slot.carried_px + neighbours.by;
  const double deviation_px = kStrain_px + neighbours.disagreement_px +
                              kDoubt_px_per_s / job.frame->rate.per_s() * static_cast<double>(frames - 1);
  prediction.covariance_px2 = deviation_px * deviation_px * Matrix2d::Identity();
  return prediction;
}

const PixelPrediction& surer(const PixelPrediction& a, const PixelPrediction& b) noexcept {
  if (!a.valid || !b.valid) return a.valid ? a : b;
  return a.covariance_px2.trace() < b.covariance_px2.trace() ? a : b;
}

}  // namespace perimap
