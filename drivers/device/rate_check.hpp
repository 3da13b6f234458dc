// Whether a device counts as fast as its configuration says.
#pragma once

#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

// An ArrivalClock takes the nominal rate as right to half a percent; with a wrong one its stamps are wrong and nothing
// shows it. So counts are held against their arrivals, over spans of a quarter second, off by more than 30 %, and of a
// second, off by more than 5 %: either twice in a row and in the same direction, and the rate is wrong, until a second
// is right. A count that jumps, or a machine that stood still, makes one span too fast or too slow and not two.
//
// A span goes from the earliest arrival, for its count, of one quarter second to that of another, since arrivals are
// late by a varying amount and never early.
class RateCheck {
 public:
  explicit RateCheck(double nominal_hz) noexcept : nominal_hz_(nominal_hz) {}

  // Count `count` arrived. Counts may be left out and may repeat. One that goes back, or half a second without any,
  // begins the measurement anew.
  void observe(std::int64_t count, Instant arrival) noexcept;
  // The device counts anew; what is known of its rate stays.
  void restart() noexcept { started_ = false; }

  [[nodiscard]] bool wrong() const noexcept { return wrong_; }
  // Over the last second, or the quarter that told; 0 before.
  [[nodiscard]] double seen_hz() const noexcept { return seen_hz_; }

 private:
  static constexpr Duration kQuarter = std::chrono::milliseconds(250);
  static constexpr Duration kLongestGap = std::chrono::milliseconds(500);

  struct Point {
    std::int64_t count = 0;
    Instant arrival;
  };
  struct Span {
    int quarters = 1;
    double tolerance = 0.0;
    Point from = {};
    int since = 0;   // quarters
    int before = 0;  // of the span before: -1 too slow, 0 right or unknown, 1 too fast
  };

  void begin(const Point& first) noexcept;
  void end_quarter() noexcept;
  // Whether the span was the second in a row that is off, and the same way. Ends at `earliest_`.
  [[nodiscard]] bool off_again(Span& span) noexcept;
  // How much later for its count `b` is than `a`, s.
  [[nodiscard]] double later_s(const Point& a, const Point& b) const noexcept;

  double nominal_hz_;
  bool started_ = false;
  Point last_;
  Instant quarter_begin_;
  Point earliest_;    // of the quarter
  bool any_ = false;  // a quarter has ended
  Span short_{1, 0.3};
  Span long_{4, 0.05};
  bool wrong_ = false;
  double seen_hz_ = 0.0;
};

}  // namespace perimap
