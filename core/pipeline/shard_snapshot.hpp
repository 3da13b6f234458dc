// What a worker hands to the publisher after evaluating its features for one frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/estimation/feature_estimate.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/realtime/triple_buffer.hpp"

namespace perimap {

// A snapshot serves the release of its own frame and of the two before it: with L longer than the time from frame to
// frame, the next frames are mapped before a release is due.
inline constexpr std::size_t kReleasesCovered = 3;
// Between two frames the clock's releases fall anywhere. For them a snapshot holds covariances at so many instants,
// from when it becomes known until the next one should be; between two of them it is interpolated.
inline constexpr std::size_t kInstantsCovered = 4;
inline constexpr std::size_t kCovariances = kReleasesCovered + kInstantsCovered;

// One started feature: enough to evaluate it at any instant near the release.
struct FeatureSnapshot {
  std::uint32_t id = 0;
  FeatureState state = FeatureState::kInvalid;
  FeatureReason reason = FeatureReason::kNone;
  StateVector x;  // mm, see core/periodic
  // B P B^T at the releases that the shard names, then at its instants. Of a stream that is not published: anything.
  std::array<Matrix3d, kCovariances> covariances_W_mm2;
  Instant last_observed;
  Instant first_observed;
  Vector2d first_observed_px = Vector2d::Zero();
  double largest_deviation_mm = 0.0;
};

struct ShardSnapshot {
  std::array<std::uint64_t, kReleasesCovered> release_sequences{};  // frames at whose releases covariances are given
  std::array<CameraPlace, kReleasesCovered> cameras{};              // at their captures
  std::array<Instant, kInstantsCovered> instants{};                 // valid times, rising; all the same: none
  bool any = false;                                                 // false until the first frame
  std::uint64_t frame_sequence = 0;                                 // of the frame whose update this is
  Instant capture;                                                  // of that frame
  bool pose_missing = false;                                        // that frame gave no measurement for want of a pose
  std::vector<FeatureSnapshot> features;                            // capacity reserved at start
};

// The worker is the one writer; the publisher and the model publisher read a cell each.
struct ShardCells {
  TripleBuffer<ShardSnapshot> publisher;
  TripleBuffer<ShardSnapshot> model;
};

}  // namespace perimap
