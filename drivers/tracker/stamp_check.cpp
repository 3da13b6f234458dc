#include "drivers/tracker/stamp_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace perimap {
namespace {

constexpr double kUnit = 4294967296.0;  // of a fixed-point stamp, a second
constexpr std::uint64_t kFraction = 0xFFFFFFFFU;
constexpr std::uint64_t kNanoseconds = 1'000'000'000U;

}  // namespace

// Over the end of the seconds' 32 bits, too, which milliseconds in their place reach.
double StampCheck::stamped_s(const Point& from, const Point& to) noexcept {
  return static_cast<double>(static_cast<std::int64_t>(to.stamp - from.stamp)) / kUnit;
}

int StampCheck::off(const Point& from, const Point& to, double share, double shortest_s) noexcept {
  const double passed_s = to_seconds(to.arrival - from.arrival);
  const double apart_s = stamped_s(from, to) - passed_s;
  if (std::abs(apart_s) <= share * std::max(passed_s, shortest_s)) return 0;
  return apart_s < 0.0 ? -1 : 1;
}

void StampCheck::begin(const Point& first) noexcept {
  started_ = true;
  seen_ = 0;
  quarters_off_ = 0;
  second_off_ = 0;
  twice_off_ = long_off_ = sparse_ = false;
  long_before_ = 0;
  now_ = second_ = {};
  quarter_begin_ = first.arrival;
  earliest_ = long_from_ = first;
}

void StampCheck::observe(std::uint64_t stamp, Instant arrival) {
  const Point point{stamp, arrival};
  const bool anew = !started_ || arrival - last_.arrival > kLongestGap;
  const bool changed = anew || stamp != last_.stamp;
  last_ = point;
  if (anew) {
    begin(point);
  } else if (arrival - quarter_begin_ >= kQuarter) {
    end_quarter();
    quarter_begin_ = arrival;
    earliest_ = point;
  } else if (stamped_s(earliest_, point) > to_seconds(arrival - earliest_.arrival)) {
    earliest_ = point;
  }
  ++now_.messages;
  now_.changes += changed ? 1 : 0;
  now_.whole = now_.whole && (stamp & kFraction) == 0;
  now_.small = now_.small && (stamp & kFraction) < kNanoseconds;
}

void StampCheck::end_quarter() {
  std::shift_left(quarters_.begin(), quarters_.end(), 1);
  quarters_.back() = earliest_;
  ++seen_;
  if (seen_ == 1) {
    long_from_ = earliest_;
    now_ = {};
    return;
  }
  const bool quarter_off = off(quarters_[kQuarters - 1], earliest_, 0.3, to_seconds(kQuarter)) != 0;
  quarters_off_ = (quarters_off_ << 1U | (quarter_off ? 1U : 0U)) & 0xFU;
  // A clock that is set is no clock that runs at another pace.
  if (quarter_off) long_from_ = earliest_;
  if (earliest_.arrival - long_from_.arrival >= kLong) {
    const int direction = off(long_from_, earliest_, 0.01, 0.0);
    long_off_ = direction != 0 && direction == long_before_;
    long_before_ = direction;
    long_from_ = earliest_;
  }
  if ((seen_ - 1) % kQuarters == 0) end_second(earliest_);
  const bool now_wrong = std::popcount(quarters_off_) >= 3 || twice_off_ || long_off_ || sparse_;
  if (now_wrong) {
    if (!wrong_) fault_ = describe();
    wrong_ = true;
  } else if (wrong_ && seen_ > kQuarters && quarters_off_ == 0 && second_off_ == 0) {
    wrong_ = false;
    fault_.clear();
  }
}

void StampCheck::end_second(const Point& newest) {
  const int direction = off(quarters_.front(), newest, 0.05, 1.0);
  twice_off_ = direction != 0 && direction == second_off_;
  second_off_ = direction;
  second_ = std::exchange(now_, {});
  constexpr int kFewMessages = 6;
  sparse_ = second_.messages >= kFewMessages && second_.changes <= 2;
  judged_ = true;
  if (wrong_) fault_ = describe();  // more has been seen of it
}

std::string StampCheck::describe() const {
  const std::size_t from = seen_ > kQuarters ? 0 : kQuarters + 1 - seen_;
  const double passed_s = to_seconds(quarters_.back().arrival - quarters_[from].arrival);
  const double pace = passed_s > 0.0 ? stamped_s(quarters_[from], quarters_.back()) / passed_s : 1.0;
  const Look& look = now_.messages > 0 ? now_ : second_;
  const auto near = [pace](double unit) { return std::abs(pace / unit - 1.0) < 0.3; };
  if (near(1e3)) return "milliseconds where seconds belong";
  if (near(1e6)) return "microseconds where seconds belong";
  if (near(1e9)) return "nanoseconds where seconds belong";
  if (look.whole && std::abs(pace) < 4.0) return "whole seconds";
  if (look.whole) return fmt::format("counts, such as frame numbers, {:.0f} a second", pace);
  if (sparse_) return kStandStill;
  // Within a second such stamps go on by 1e9 / 2^32 of what passes.
  const double quarter_s = to_seconds(quarters_[kQuarters].arrival - quarters_[kQuarters - 1].arrival);
  const double quarter_pace = stamped_s(quarters_[kQuarters - 1], quarters_[kQuarters]) / quarter_s;
  const bool as_nanoseconds = std::abs(quarter_pace - static_cast<double>(kNanoseconds) / kUnit) < 0.03;
  if (look.small && (as_nanoseconds || quarter_pace > 1.3)) {
    return "fractions of a second in nanoseconds, where 2^-32 s are meant";
  }
  return fmt::format("of a clock that runs at {:.3g} of ours", pace);
}

}  // namespace perimap
