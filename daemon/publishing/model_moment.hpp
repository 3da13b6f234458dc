// What a surface model is made of.
#pragma once

#include <span>

#include "core/periodic/basis.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/pipeline/surface_state.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// One moment of the map and its clocks.
struct ModelMoment {
  std::span<const ShardSnapshot* const> snapshots;  // in order of shard
  BasisLayout layout;
  CardiacClock clock;
  RespiratoryClock respiration;
  SurfaceFooting footing;
  Instant now;
  Duration utc_minus_monotonic{0};
  Duration validity{0};  // nothing is said of instants further ahead
};

}  // namespace perimap
