// The basis at the phases of the two clocks.
#pragma once

#include "core/periodic/basis.hpp"
#include "core/phase/respiratory_clock.hpp"

namespace perimap {

[[nodiscard]] inline Basis basis_at(const BasisLayout& layout, double cardiac_phase_rad,
                                    const RespiratoryPhase& respiration) noexcept {
  return respiration.known ? basis_at(layout, cardiac_phase_rad, respiration.phase_rad)
                           : basis_without_breath(layout, cardiac_phase_rad);
}

}  // namespace perimap
