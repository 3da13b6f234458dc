// Whether a device counts as fast as its configuration says.
#pragma once

#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

// An ArrivalClock takes the nominal rate as right to half a percent; with a wrong one its stamps are wrong and nothing
// shows it. So counts are held against their arrivals: off by more than 5 % over 3 s, twice in a row and in the same
// direction, the rate is wrong, until it has been right for as long. One late arrival at the seam of the two, as from
// a machine that stood still, makes one of them too slow and the other too fast.
class RateCheck {
 public:
  explicit RateCheck(double nominal_hz) noexcept : nominal_hz_(nominal_hz) {}

  // Count `count` arrived. Counts may be left out and may repeat. One that goes back, or half a second without any,
  // begins the measurement anew.
  void observe(std::int64_t count, Instant arrival) noexcept;
  // The device counts anew; what is known of its rate stays.
  void restart() noexcept { started_ = false; }

  [[nodiscard]] bool wrong() const noexcept { return wrong_; }
  // Over the last 3 s that were measured; 0 before.
  [[nodiscard]] double seen_hz() const noexcept { return seen_hz_; }

 private:
  static constexpr Duration kWindow = std::chrono::seconds(3);
  static constexpr Duration kLongestGap = std::chrono::milliseconds(500);
  static constexpr double kTolerance = 0.05;

  void begin(std::int64_t count, Instant arrival) noexcept;

  double nominal_hz_;
  bool started_ = false;
  std::int64_t begin_count_ = 0;
  Instant begin_;
  std::int64_t last_count_ = 0;
  Instant last_;
  int before_ = 0;  // of the window before: -1 too slow, 0 right or unknown, 1 too fast
  bool wrong_ = false;
  double seen_hz_ = 0.0;
};

}  // namespace perimap
