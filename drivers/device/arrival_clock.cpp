#include "drivers/device/arrival_clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace perimap {

ArrivalClock::Point ArrivalClock::point(std::int64_t count, Instant arrival) const noexcept {
  const auto since = static_cast<double>(count - origin_count_);
  return {since, static_cast<double>((arrival - origin_).count()) - since * settings_.period_ns};
}

void ArrivalClock::start(std::int64_t count, Instant arrival) noexcept {
  started_ = true;
  origin_count_ = count;
  last_count_ = count;
  origin_ = arrival;
  intervals_ = 0;
  current_ = {};
  interval_begin_count_ = 0.0;
  late_intervals_ = 0;
  offset_ = 0.0;
  slope_ = 0.0;
}

void ArrivalClock::observe(std::int64_t count, Instant arrival) noexcept {
  if (!started_ || count < last_count_ ||
      static_cast<double>(count - last_count_) * settings_.period_ns > kLongestGap_ns) {
    return start(count, arrival);
  }
  last_count_ = count;
  const Point p = point(count, arrival);
  if ((p.count - interval_begin_count_) * settings_.period_ns >= kInterval_ns) {
    close_interval();
    interval_begin_count_ = p.count;
    current_ = p;
  } else if (p.late_ns - slope_ * p.count < current_.late_ns - slope_ * current_.count) {
    current_ = p;
  }
  const double early_ns = edge(p.count) - p.late_ns;
  if (early_ns <= 0.0) return;
  // Nothing arrives early: all that is known so far was late by at least this much.
  if (early_ns > kStep_ns) intervals_ = 0;
  offset_ -= early_ns;
}

void ArrivalClock::close_interval() noexcept {
  late_intervals_ = current_.late_ns - edge(current_.count) > kStep_ns ? late_intervals_ + 1 : 0;
  if (late_intervals_ >= kLateIntervals) {
    intervals_ = 0;
    late_intervals_ = 0;
  }
  if (intervals_ == kIntervals) {
    std::move(earliest_.begin() + 1, earliest_.end(), earliest_.begin());
    --intervals_;
  }
  earliest_[intervals_++] = current_;
  fit();
}

void ArrivalClock::fit() noexcept {
  // Lower convex hull, left to right (Andrew's monotone chain); the points lie in order of count.
  std::array<Point, kIntervals> hull;
  std::size_t size = 0;
  double mean = 0.0;
  for (std::size_t i = 0; i < intervals_; ++i) {
    const Point& p = earliest_[i];
    mean += p.count / static_cast<double>(intervals_);
    const auto above = [&p](const Point& a, const Point& b) {
      return (b.count - a.count) * (p.late_ns - a.late_ns) <= (p.count - a.count) * (b.late_ns - a.late_ns);
    };
    while (size >= 2 && above(hull[size - 2], hull[size - 1])) --size;
    hull[size++] = p;
  }
  slope_ = 0.0;
  const double span_ns = (earliest_[intervals_ - 1].count - earliest_[0].count) * settings_.period_ns;
  if (span_ns >= kShortestSpan_ns) {
    std::size_t right = 1;
    while (right + 1 < size && hull[right].count < mean) ++right;
    const Point& a = hull[right - 1];
    const Point& b = hull[right];
    const double most = settings_.rate_tolerance * settings_.period_ns;
    slope_ = std::clamp((b.late_ns - a.late_ns) / (b.count - a.count), -most, most);
  }
  offset_ = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < size; ++i) offset_ = std::min(offset_, hull[i].late_ns - slope_ * hull[i].count);
}

Instant ArrivalClock::stamp(std::int64_t count) const noexcept {
  const auto since = static_cast<double>(count - origin_count_);
  return origin_ + Duration(std::llround(since * settings_.period_ns + edge(since))) - settings_.transport_delay;
}

Duration ArrivalClock::lateness(std::int64_t count, Instant arrival) const noexcept {
  const Point p = point(count, arrival);
  return Duration(std::llround(std::max(0.0, p.late_ns - edge(p.count))));
}

double ArrivalClock::count_at(Instant arrival) const noexcept {
  const auto since_ns = static_cast<double>((arrival - origin_).count());
  return static_cast<double>(origin_count_) + (since_ns - offset_) / period_ns();
}

}  // namespace perimap
