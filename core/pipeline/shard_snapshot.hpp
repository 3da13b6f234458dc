// What a worker hands to the publisher after evaluating its features for one frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/estimation/feature_estimate.hpp"
#include "core/pipeline/frame_doubts.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/realtime/triple_buffer.hpp"

namespace perimap {

// A snapshot holds covariances at instants from when it becomes known until the next one should be; between two of them
// it is interpolated. To the frames' stream these are releases: that of the oldest frame that is still to come, however
// long L is, and two later ones, at usual rates the next two. The clock's fall anywhere.
inline constexpr std::size_t kReleasesCovered = 3;
inline constexpr std::size_t kInstantsCovered = 4;
inline constexpr std::size_t kCovariances = kReleasesCovered + kInstantsCovered;

// Where the camera was is told for the frames whose releases come while the snapshot is the newest, and for some
// before, of a publisher that was held up.
inline constexpr std::size_t kCamerasBefore = 8;
inline constexpr std::size_t kCamerasKept = 24;
struct FrameCamera {
  std::uint64_t frame_sequence = 0;
  CameraPlace place;  // at that frame's capture
};

// One started feature: enough to evaluate it at any instant near the release.
struct FeatureSnapshot {
  std::uint32_t id = 0;
  FeatureState state = FeatureState::kInvalid;
  FeatureReason reason = FeatureReason::kNone;
  StateVector x;  // mm, see core/periodic
  // B P B^T at the shard's instants. Of a stream that is not published: anything.
  std::array<Matrix3d, kCovariances> covariances_W_mm2;
  Instant last_observed;
  Instant first_observed;
  Vector2d first_observed_px = Vector2d::Zero();
  double largest_deviation_mm = 0.0;
  bool held_back = false;  // certain of itself, but not with what the set-up may be off by
  bool expected = false;   // it was looked for, and the map has it in the image
  bool in_sight = false;   // it agreed with the map in that frame or shortly before
};

struct ShardSnapshot {
  // Valid times: kReleasesCovered of the frames' stream, rising, then those of the clock's; all the same: none.
  std::array<Instant, kCovariances> instants{};
  std::array<FrameCamera, kCamerasKept> cameras{};
  bool any = false;                       // false until the first frame
  bool recalled = false;                  // of an earlier run: older than any frame of this one, without a number
  std::uint64_t frame_sequence = 0;       // of the frame whose update this is
  Instant capture;                        // of that frame
  CameraPlace camera;                     // at that capture
  bool pose_missing = false;              // that frame gave no measurement for want of a pose
  FrameDoubts doubts;                     // likewise of that frame
  std::vector<FeatureSnapshot> features;  // capacity reserved at start
};

// The worker is the one writer; the publisher and the model publisher read a cell each.
struct ShardCells {
  TripleBuffer<ShardSnapshot> publisher;
  TripleBuffer<ShardSnapshot> model;
};

}  // namespace perimap
