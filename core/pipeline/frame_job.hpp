// One frame's facts that all features share.
#pragma once

#include <array>
#include <cstdint>

#include "core/estimation/shared_pose.hpp"
#include "core/periodic/basis.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/phase_spread.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/time/instant.hpp"
#include "core/vision/neighbour_motion.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

// A frame that this job's snapshot serves the release of.
struct CoveredRelease {
  std::uint64_t frame_sequence = 0;
  CameraPlace camera;  // at that frame's capture
};

// The bases at which covariances are evaluated, with the phase as known now: those of the shard's releases, then those
// of its instants. Only [begin, end) are asked for: a stream that is not published costs nothing.
struct EvaluatedBases {
  std::array<Basis, kCovariances> b;
  std::size_t begin = 0;
  std::size_t end = 0;
};

// Written by the mapper before a stage, read by all workers during it.
struct FrameJob {
  const FrameRecord* frame = nullptr;
  const FrameHistory* history = nullptr;
  GreyImage image;  // while features are searched for
  const PatchTracker* tracker = nullptr;
  BasesAbout about_capture;
  std::array<CoveredRelease, kReleasesCovered> releases;
  std::array<Instant, kInstantsCovered> instants{};
  EvaluatedBases evaluated;
  // After B: how the features found have moved, and the pose that they agree on; null when they do not tell it.
  const NeighbourMotion* motion = nullptr;
  const CommonEstimate* shared_pose = nullptr;
  Instant learn_until;  // learning that has not begun by then is put off; never in lockstep
};

}  // namespace perimap
