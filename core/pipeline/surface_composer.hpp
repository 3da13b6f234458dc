// Makes the surface of one release from the workers' newest snapshots and the newest phase.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/periodic/basis.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/pipeline/surface_sample.hpp"

namespace perimap {

struct ComposerSettings {
  BasisLayout layout;
  Duration lead{0};                                    // valid time minus release
  Duration validity = std::chrono::milliseconds(200);  // a sample must not be used longer after its valid time
  std::size_t maximum_features = 0;
};

// Belongs to the publisher. Positions and velocities are evaluated anew from the coefficients with the phase as it is
// known now. To the covariance of the map comes phase_spread(), what the phase's deviation makes of the motion.
class SurfaceComposer {
 public:
  explicit SurfaceComposer(const ComposerSettings& settings);

  // `snapshots` in order of shard, none null. The sample stays valid until the next call.
  [[nodiscard]] const SurfaceSample& compose(const Release& release, const CardiacClock& clock,
                                             const RespiratoryClock& respiration,
                                             std::span<const ShardSnapshot* const> snapshots) noexcept;

 private:
  ComposerSettings settings_;
  SurfaceSample sample_;
  struct Ordered {
    const FeatureSnapshot* feature;
    std::size_t covered;  // which of its covariances is of this release; kReleasesCovered: none
  };
  std::vector<Ordered> order_;
};

}  // namespace perimap
