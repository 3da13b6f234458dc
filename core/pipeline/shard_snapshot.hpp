// What a worker hands to the publisher after evaluating its features for one frame.
#pragma once

#include <cstdint>
#include <vector>

#include "core/estimation/feature_estimate.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/realtime/triple_buffer.hpp"

namespace perimap {

// One started feature: enough to evaluate it at any instant near the release.
struct FeatureSnapshot {
  std::uint32_t id = 0;
  FeatureState state = FeatureState::kInvalid;
  FeatureReason reason = FeatureReason::kNone;
  StateVector x;              // mm, see core/periodic
  Matrix3d covariance_W_mm2;  // B P B^T at the release time's phase
  Instant last_observed;
  Instant first_observed;
  Vector2d first_observed_px = Vector2d::Zero();
  double largest_deviation_mm = 0.0;
};

struct ShardSnapshot {
  bool any = false;                       // false until the first frame
  std::uint64_t frame_sequence = 0;       // of the frame whose update this is
  bool pose_missing = false;              // that frame gave no measurement for want of a pose
  std::vector<FeatureSnapshot> features;  // capacity reserved at start
};

// The worker is the one writer; the publisher and the model publisher read a cell each.
struct ShardCells {
  TripleBuffer<ShardSnapshot> publisher;
  TripleBuffer<ShardSnapshot> model;
};

}  // namespace perimap
