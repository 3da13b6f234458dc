#include "core/pipeline/scope_turn.hpp"

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

NotchReading mean(const NotchReading& a, double weight_a, const NotchReading& b) noexcept {
  const double share = 1.0 / (weight_a + 1.0);
  const double rotation_rad = a.rotation_rad + share * turn_between(b.rotation_rad, a.rotation_rad);
  return {std::remainder(rotation_rad, kTwoPi), a.deviation_rad + share * (b.deviation_rad - a.deviation_rad)};
}

}  // namespace

bool ScopeTurn::agree(const NotchReading& a, const NotchReading& b) noexcept {
  const double deviation_rad = std::hypot(a.deviation_rad, b.deviation_rad);
  return std::abs(turn_between(a.rotation_rad, b.rotation_rad)) <= std::max(kSame_rad, 4.0 * deviation_rad);
}

void ScopeTurn::set_circle(const FieldStopReading& reading) noexcept {
  stop_ = reading;
  circles_ = 1.0;
}

// The mean of the last ones, while they are of one circle.
void ScopeTurn::follow_circle(const FieldStopReading& reading) noexcept {
  constexpr double kCirclesInMean = 8.0;
  constexpr double kSame_px = 1.0;
  const double off_px =
      std::max(std::abs(reading.radius_px - stop_->radius_px), (reading.centre_px - stop_->centre_px).norm());
  if (off_px > std::max(kSame_px, 4.0 * std::hypot(reading.centre_deviation_px, stop_->centre_deviation_px))) {
    set_circle(reading);
    return;
  }
  const double share = 1.0 / (circles_ + 1.0);
  FieldStopReading followed = reading;  // its levels and its noise
  followed.radius_px = stop_->radius_px + share * (reading.radius_px - stop_->radius_px);
  followed.centre_px = stop_->centre_px + share * (reading.centre_px - stop_->centre_px);
  stop_ = followed;
  circles_ = std::min(circles_ + 1.0, kCirclesInMean);
}

bool ScopeTurn::adopt(const FieldStopReading& reading, const std::optional<NotchReading>& seen_then) noexcept {
  const NotchReading notch{reading.notch_rad, reading.notch_deviation_rad};
  if (stop_ && seen_then && agree(notch, *seen_then)) {
    follow_circle(reading);
    return false;
  }
  const bool mistaken = stop_ && seen_then;
  set_circle(reading);
  near_rad_ = reading.notch_rad;
  candidate_.reset();
  readings_ = 0.0;
  return mistaken;
}

void ScopeTurn::give_up() noexcept {
  stop_.reset();
  candidate_.reset();
  readings_ = 0.0;
}

void ScopeTurn::look(const GreyImage& picture) noexcept {
  take(stop_ ? read_notch_near(picture, *stop_, near_rad_) : std::nullopt);
}

void ScopeTurn::take(const std::optional<NotchReading>& reading) noexcept {
  state_.reset();
  seen_ = reading;
  if (!reading || !stop_) return;
  near_rad_ = reading->rotation_rad;
  if (readings_ > 0.0 && agree(*reading, held_)) {
    settle(mean(held_, readings_, *reading), std::min(readings_ + 1.0, kReadingsInMean));
  } else if (candidate_ && agree(*reading, *candidate_)) {
    settle(mean(*candidate_, 1.0, *reading), 2.0);
  } else {
    candidate_ = reading;
    readings_ = 0.0;
  }
}

void ScopeTurn::settle(const NotchReading& reading, double readings) noexcept {
  candidate_.reset();
  held_ = reading;
  readings_ = readings;
  near_rad_ = reading.rotation_rad;
  const auto lens = scope_.lens_at(reading.rotation_rad, stop_->radius_px);
  if (!lens) return;  // at this zoom nothing was calibrated
  ScopeState state;
  state.X_SC = scope_.at(reading.rotation_rad).X_SC;
  const bool of_lens = lens->focal_px.minCoeff() > 0.0;
  state.picture = pixel_map(lens_, of_lens ? lens->focal_px : Vector2d(lens_.fx, lens_.fy), lens->principal_px);
  state.rotation_rad = reading.rotation_rad;
  state.rotation_deviation_rad = reading.deviation_rad / std::min(3.0, std::sqrt(readings));
  state_ = state;
  const bool turned = known_ && std::abs(turn_between(known_->rotation_rad, reading.rotation_rad)) > 2.0 * kDegree;
  const bool zoomed =
      known_ && std::abs(stop_->radius_px - known_->radius_px) > TurnedScope::kSameZoom * known_->radius_px;
  if (turned || zoomed) ++turns_;
  if (!known_ || turned || zoomed) known_ = Known{reading.rotation_rad, stop_->radius_px};
}

}  // namespace perimap
