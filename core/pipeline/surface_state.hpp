// What is wrong with a surface, and how far it may be used all the same.
#pragma once

#include <span>

#include "core/phase/cardiac_clock.hpp"
#include "core/pipeline/frame_doubts.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/pipeline/surface_sample.hpp"

namespace perimap {

// What a surface rests on beside the phase.
struct SurfaceFooting {
  bool breath_doubtful = false;  // RespiratoryClock::doubtful()
  bool mapped = false;           // there are features
  bool frame_missing = false;
  bool update_late = false;
  bool pose_missing = false;
  FrameDoubts doubts = {};
  bool not_seen = false;     // see Sight
  bool no_parallax = false;  // the camera keeps still, and no feature has converged
  bool converged = true;     // some of the features have
  bool held_back = false;    // some would have, were more known of the set-up
};

// As far as the newest snapshots tell: whether there are features, poses and sight of them.
[[nodiscard]] SurfaceFooting footing_of(std::span<const ShardSnapshot* const> snapshots) noexcept;

// The first thing that is wrong, worst first.
[[nodiscard]] SurfaceReason reason_of(const PhaseEstimate& phase, Rhythm rhythm,
                                      const SurfaceFooting& footing) noexcept;

[[nodiscard]] SurfaceState state_of(SurfaceReason reason) noexcept;

// Nothing is wrong but that what is published is predicted from before, which makes it as much less certain as it says.
// Not by its reason, which is the first of several.
[[nodiscard]] bool is_accounted_for(const PhaseEstimate& phase, Rhythm rhythm, SurfaceFooting footing) noexcept;

struct FeatureVerdict {
  FeatureState state = FeatureState::kInvalid;
  FeatureReason reason = FeatureReason::kNone;
};

// What is to be said of a feature whose filter says `own`, in a surface with this phase and footing.
[[nodiscard]] FeatureVerdict verdict_of(const FeatureVerdict& own, PhaseState phase,
                                        const SurfaceFooting& footing) noexcept;

}  // namespace perimap
