#include "drivers/device/rate_check.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {

double RateCheck::later_s(const Point& a, const Point& b) const noexcept {
  return to_seconds(b.arrival - a.arrival) - static_cast<double>(b.count - a.count) / nominal_hz_;
}

void RateCheck::begin(const Point& first) noexcept {
  started_ = true;
  any_ = false;
  short_.before = long_.before = 0;
  quarter_begin_ = first.arrival;
  earliest_ = first;
}

void RateCheck::observe(std::int64_t count, Instant arrival) noexcept {
  const Point point{count, arrival};
  const bool anew = !started_ || count < last_.count || arrival - last_.arrival > kLongestGap;
  last_ = point;
  if (anew) return begin(point);
  if (arrival - quarter_begin_ >= kQuarter) {
    end_quarter();
    quarter_begin_ = arrival;
    earliest_ = point;
  } else if (later_s(earliest_, point) < 0.0) {
    earliest_ = point;
  }
}

void RateCheck::end_quarter() noexcept {
  if (!any_) {
    any_ = true;
    short_.from = long_.from = earliest_;
    short_.since = long_.since = 0;
    return;
  }
  const bool by_far = off_again(short_);
  const bool by_little = off_again(long_);
  if (by_far || by_little) wrong_ = true;
  if (long_.since == 0 && long_.before == 0) wrong_ = false;
}

bool RateCheck::off_again(Span& span) noexcept {
  if (++span.since < span.quarters) return false;
  const double later = later_s(span.from, earliest_);
  const double seconds = to_seconds(earliest_.arrival - span.from.arrival);
  // The earliest of two quarters may lie close together; what one is later than the other counts for the whole span.
  const double limit = span.tolerance * std::max(seconds, span.quarters * to_seconds(kQuarter));
  const int off = std::abs(later) <= limit ? 0 : later > 0.0 ? -1 : 1;
  const bool again = off != 0 && off == span.before;
  if (seconds > 0.0 && (again || span.quarters == long_.quarters)) {
    seen_hz_ = static_cast<double>(earliest_.count - span.from.count) / seconds;
  }
  span.from = earliest_;
  span.since = 0;
  span.before = off;
  return again;
}

}  // namespace perimap
