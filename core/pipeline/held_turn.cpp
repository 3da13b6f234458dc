#include "core/pipeline/held_turn.hpp"

#include <algorithm>
#include <cmath>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

// Readings farther apart than this, and than four of their deviations, are of a scope that was turned. At 90 mm half a
// degree, as a 30-degree scope's line of sight turns by it, is 0.4 mm.
constexpr double kSame_rad = 0.5 * kDegree;
constexpr double kReadingsInMean = 8.0;

double turn_between(double a_rad, double b_rad) noexcept { return std::remainder(a_rad - b_rad, kTwoPi); }

TurnReading mean(const TurnReading& a, double weight_a, const TurnReading& b) noexcept {
  const double share = 1.0 / (weight_a + 1.0);
  const double rotation_rad = a.rotation_rad + share * turn_between(b.rotation_rad, a.rotation_rad);
  return {std::remainder(rotation_rad, kTwoPi), a.deviation_rad + share * (b.deviation_rad - a.deviation_rad)};
}

}  // namespace

bool HeldTurn::agree(const TurnReading& a, const TurnReading& b) noexcept {
  const double deviation_rad = std::hypot(a.deviation_rad, b.deviation_rad);
  return std::abs(turn_between(a.rotation_rad, b.rotation_rad)) <= std::max(kSame_rad, 4.0 * deviation_rad);
}

void HeldTurn::forget() noexcept {
  candidate_.reset();
  readings_ = 0.0;
}

std::optional<TurnReading> HeldTurn::hold(const TurnReading& reading) noexcept {
  if (readings_ > 0.0) {
    const double ahead_rad = turn_between(reading.rotation_rad, held_.rotation_rad);
    lead_rad_ += (std::clamp(ahead_rad, -kSame_rad, kSame_rad) - lead_rad_) / kReadingsInMean;
    if (agree(reading, held_)) {
      return settle(mean(held_, readings_, reading), std::min(readings_ + 1.0, kReadingsInMean));
    }
  }
  if (candidate_ && agree(reading, *candidate_)) return settle(mean(*candidate_, 1.0, reading), 2.0);
  candidate_ = reading;
  readings_ = 0.0;
  return std::nullopt;
}

TurnReading HeldTurn::settle(const TurnReading& mean, double readings) noexcept {
  candidate_.reset();
  held_ = mean;
  readings_ = readings;
  const double of_mean = mean.deviation_rad * std::max(common_share_, 1.0 / std::sqrt(readings));
  return {mean.rotation_rad, std::hypot(of_mean, lead_rad_)};
}

}  // namespace perimap
