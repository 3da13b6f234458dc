// What the deviation of the cardiac phase makes of a feature's position: the mean square of where the feature would be
// one deviation earlier and one later. That is v v^T sigma_t^2 while the deviation is small, and does not vanish with a
// large one where the motion turns.
#pragma once

#include <algorithm>
#include <numbers>

#include "core/geometry/pose.hpp"
#include "core/periodic/basis.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/pipeline/phase_basis.hpp"

namespace perimap {

// The basis one deviation of the phase earlier and one later.
struct BasesAbout {
  Basis earlier;
  Basis later;
};

[[nodiscard]] inline BasesAbout bases_about(const BasisLayout& layout, const PhaseEstimate& phase,
                                            const RespiratoryPhase& respiration) noexcept {
  // Half a cycle is as wrong as a phase can be.
  const double deviation_rad = std::min(phase.deviation_s * phase.rate_rad_per_s, std::numbers::pi);
  return {basis_at(layout, phase.phase_rad - deviation_rad, respiration),
          basis_at(layout, phase.phase_rad + deviation_rad, respiration)};
}

// mm^2, from the positions (mm) at the phase itself and at the two bases.
[[nodiscard]] inline Matrix3d phase_spread(const Vector3d& p, const Vector3d& p_earlier,
                                           const Vector3d& p_later) noexcept {
  const Vector3d earlier = p_earlier - p;
  const Vector3d later = p_later - p;
  return 0.5 * (earlier * earlier.transpose() + later * later.transpose());
}

}  // namespace perimap
