#include "core/phase/ecg_line.hpp"

#include <cmath>

namespace perimap {

// The value has not changed for a second, or hardly, by the beats' measure, for longer. `anew`: what was before is
// gone.
bool EcgLine::stands_still(Instant t, float mV, bool anew) noexcept {
  const double value_mV = static_cast<double>(mV);
  if (anew || mV != newest_mV_) changed_at_ = t;
  if (anew || std::abs(value_mV - level_mV_) > settings_.hardly * excursions_mV_) {
    left_at_ = t;
    level_mV_ = value_mV;
  }
  return t - changed_at_ >= settings_.flat_after || t - left_at_ >= settings_.hardly_after;
}

}  // namespace perimap
