#include "core/pipeline/surface_use.hpp"

#include <cmath>
#include <cstddef>

namespace perimap {

double within_mm(const Matrix3d& covariance_mm2) noexcept { return 2.0 * std::sqrt(covariance_mm2.trace()); }

UseVerdicts verdicts_by_use(SurfaceState state, bool accounted_for, std::span<const SurfaceFeature> features,
                            const UseBounds& within) noexcept {
  UseVerdicts verdicts;
  std::uint32_t converged = 0;
  for (const SurfaceFeature& feature : features) {
    if (feature.state != FeatureState::kConverged) continue;
    ++converged;
    const double error_mm = within_mm(feature.covariance_W_mm2);
    for (std::size_t use = 0; use < kUses; ++use) verdicts[use].features += error_mm <= within[use] ? 1U : 0U;
  }
  if (state == SurfaceState::kInvalid) return verdicts;
  for (std::size_t use = 0; use < kUses; ++use) {
    const bool shown = use == static_cast<std::size_t>(SurfaceUse::kDisplay);
    const bool nothing_wrong = state == SurfaceState::kGood || (shown && accounted_for);
    const std::uint32_t enough = verdicts[use].features;
    const bool good = nothing_wrong && enough > 0 && 2 * enough >= converged;
    verdicts[use].state = good ? SurfaceState::kGood : SurfaceState::kDegraded;
  }
  return verdicts;
}

}  // namespace perimap
