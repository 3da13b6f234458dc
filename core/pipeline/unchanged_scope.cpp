#include "core/pipeline/unchanged_scope.hpp"

#include <algorithm>
#include <cmath>

#include "core/angle/angle.hpp"
#include "core/calibration/turned_scope.hpp"

namespace perimap {
namespace {

// At 90 mm 2 degrees, as a 30-degree scope's line of sight turns by them, are 1.6 mm. The circle must be the same one:
// what merely looks like a field stop in the scene goes elsewhere with the scope.
bool agree(const FieldStopReading& a, const FieldStopReading& b) noexcept {
  constexpr double kSame_rad = 2.0 * kDegree;
  constexpr double kSame_px = 3.0;
  const double deviation_rad = std::hypot(a.notch_deviation_rad, b.notch_deviation_rad);
  const double apart_rad = std::abs(std::remainder(a.notch_rad - b.notch_rad, kTwoPi));
  return apart_rad <= std::max(kSame_rad, 4.0 * deviation_rad) &&
         std::abs(a.radius_px - b.radius_px) <= TurnedScope::kSameZoom * b.radius_px &&
         (a.centre_px - b.centre_px).norm() <= kSame_px;
}

}  // namespace

void UnchangedScope::read(const FieldStopReading& reading) noexcept {
  constexpr int kForFirst = 3;
  constexpr int kForChange = 2;
  alike_ = last_ && agree(reading, *last_) ? alike_ + 1 : 1;
  last_ = reading;
  if (!first_) {
    if (alike_ >= kForFirst) first_ = reading;
    return;
  }
  if (alike_ < kForChange) return;
  const bool other = !agree(reading, *first_);
  if (other && !changed_) ++changes_;
  changed_ = other;
}

}  // namespace perimap
