#include "core/pipeline/scope_turn.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {

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

bool ScopeTurn::adopt(const FieldStopReading& reading, const std::optional<TurnReading>& seen_then) noexcept {
  const TurnReading notch{reading.notch_rad, reading.notch_deviation_rad};
  if (stop_ && seen_then && HeldTurn::agree(notch, *seen_then)) {
    follow_circle(reading);
    return false;
  }
  const bool mistaken = stop_ && seen_then;
  set_circle(reading);
  near_rad_ = reading.notch_rad;
  held_.forget();
  return mistaken;
}

void ScopeTurn::give_up() noexcept {
  stop_.reset();
  held_.forget();
}

void ScopeTurn::look(const GreyImage& picture) noexcept {
  follow(stop_ ? read_notch_near(picture, *stop_, near_rad_) : std::nullopt);
}

void ScopeTurn::follow(const std::optional<TurnReading>& reading) noexcept {
  state_.reset();
  seen_ = reading;
  if (!reading || !stop_) return;
  near_rad_ = reading->rotation_rad;
  const auto held = held_.hold(*reading);
  if (!held) return;
  near_rad_ = held->rotation_rad;
  state_ = states_.at(*held, stop_->radius_px);
}

}  // namespace perimap
