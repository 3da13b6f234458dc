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
  UseBounds use_within_mm{};
};

// Belongs to the publisher; one for each stream, whose samples it counts. Positions and velocities are evaluated anew
// from the coefficients with the phase as it is known now. To the covariance of the map comes phase_spread(), what the
// phase's deviation makes of the motion, and what the set-up may be off by.
//
// A frame's surface belongs to that frame. One of the clock's belongs to the newest frame that all shards have mapped,
// which may be newer than the one that is owed by then. Where that was mapped by an earlier run it keeps its capture,
// by which its age is told, and has no number.
class SurfaceComposer {
 public:
  explicit SurfaceComposer(const ComposerSettings& settings);

  // `snapshots` in order of shard, none null. The sample stays valid until the next call.
  [[nodiscard]] const SurfaceSample& compose(const Release& release, const CardiacClock& clock,
                                             const RespiratoryClock& respiration,
                                             std::span<const ShardSnapshot* const> snapshots) noexcept;

  // The last sample is not sent: the next one takes its number.
  void take_back() noexcept { --sample_.sample_sequence; }

 private:
  ComposerSettings settings_;
  SurfaceSample sample_;
  // Between which of a shard's covariances the instant that is asked for lies, and how far from the first.
  struct Covered {
    bool any = false;
    std::size_t before = 0;
    std::size_t after = 0;
    double share = 0.0;
  };
  struct Ordered {
    const FeatureSnapshot* feature = nullptr;
    Covered covered;
  };
  [[nodiscard]] static Covered covered_by(const ShardSnapshot& snapshot, const Release& release,
                                          Instant valid) noexcept;
  [[nodiscard]] static Matrix3d map_covariance(const FeatureSnapshot& feature, const Covered& covered,
                                               const FrameDoubts& doubts) noexcept;
  [[nodiscard]] bool rest_on(const Release& release, std::span<const ShardSnapshot* const> snapshots) noexcept;

  std::vector<Ordered> order_;
};

}  // namespace perimap
