// How a scope is turned in its camera head, by a reading of each frame.
#pragma once

#include <optional>

#include "core/calibration/turn_reading.hpp"

namespace perimap {

// A scope that is held is known by the mean of its last readings, whose errors are in part common to them. The first
// reading that tells another turn than those before tells none: the next one must agree with it. While the scope is
// turned slowly the mean lags behind; by how much the readings have lately led it is a part of its deviation. No heap.
class HeldTurn {
 public:
  // `common_share`: no mean is known better than this share of one reading's deviation.
  explicit HeldTurn(double common_share) noexcept : common_share_(common_share) {}

  // One frame's. None: it agrees with nothing yet.
  [[nodiscard]] std::optional<TurnReading> hold(const TurnReading& reading) noexcept;
  // What was read so far says nothing any more.
  void forget() noexcept;

  [[nodiscard]] static bool agree(const TurnReading& a, const TurnReading& b) noexcept;

 private:
  [[nodiscard]] TurnReading settle(const TurnReading& mean, double readings) noexcept;

  double common_share_;
  std::optional<TurnReading> candidate_;  // that nothing has agreed with yet
  TurnReading held_;
  double readings_ = 0.0;  // in held_; 0: it means nothing
  double lead_rad_ = 0.0;  // by how much readings have lately been ahead of it, fading
};

}  // namespace perimap
