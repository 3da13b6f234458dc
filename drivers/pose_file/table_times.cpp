#include "drivers/pose_file/table_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "core/error/one_line.hpp"

namespace perimap {
namespace {

struct NamedUnit {
  TimeUnit unit;
  std::string_view name;
  double s;
};

constexpr std::array kUnits = {NamedUnit{TimeUnit::kSecond, "s", 1.0}, NamedUnit{TimeUnit::kMillisecond, "ms", 1e-3},
                               NamedUnit{TimeUnit::kMicrosecond, "us", 1e-6},
                               NamedUnit{TimeUnit::kNanosecond, "ns", 1e-9}};

const NamedUnit& of(TimeUnit unit) noexcept { return kUnits[static_cast<std::size_t>(unit)]; }

struct Spread {
  std::size_t count = 0;
  double farthest_s = 0.0;  // from zero
  double span_s = 0.0;
  double interval_s = 0.0;  // median of what lies between times that differ
};

Spread spread_of(const std::vector<double>& times) {
  std::vector<double> sorted;
  for (const double t : times) {
    if (std::isfinite(t)) sorted.push_back(t);
  }
  Spread spread;
  if (sorted.empty()) return spread;
  std::sort(sorted.begin(), sorted.end());
  spread.count = sorted.size();
  // A row in a hundred, and one at least, may have none of the times: zeros, where a tool was hidden.
  constexpr std::size_t kEnough = 10;
  const std::size_t apart = sorted.size() < kEnough ? 0 : 1 + sorted.size() / 100;
  const double first = sorted[apart];
  const double last = sorted[sorted.size() - 1 - apart];
  spread.farthest_s = std::max(std::abs(first), std::abs(last));
  spread.span_s = last - first;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i] > sorted[i - 1]) intervals.push_back(sorted[i] - sorted[i - 1]);
  }
  if (intervals.empty()) return spread;
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  spread.interval_s = *middle;
  return spread;
}

// The one by which they are most nearly thirty a second; of a time alone, by which it is of these years.
const NamedUnit& likely_unit(const Spread& spread) noexcept {
  constexpr double kUsual_s = 1.0 / 30.0;
  constexpr double kTheseYears_s = 1.7e9;  // since 1970
  const bool one = !(spread.interval_s > 0.0);
  const auto off = [&](const NamedUnit& unit) {
    return std::abs(std::log(one ? unit.s * spread.farthest_s / kTheseYears_s : unit.s * spread.interval_s / kUsual_s));
  };
  return *std::min_element(kUnits.begin() + 1, kUnits.end(),
                           [&](const NamedUnit& a, const NamedUnit& b) { return off(a) < off(b); });
}

std::string duration_text(double s) {
  constexpr double kHour_s = 3600.0;
  constexpr double kDay_s = 24.0 * kHour_s;
  constexpr double kYear_s = 365.25 * kDay_s;
  if (s >= kYear_s) return fmt::format("{:.3g} years", s / kYear_s);
  if (s >= kDay_s) return fmt::format("{:.3g} days", s / kDay_s);
  return fmt::format("{:.3g} hours", s / kHour_s);
}

}  // namespace

std::optional<TimeUnit> time_unit_named(std::string_view name) noexcept {
  for (const NamedUnit& unit : kUnits) {
    if (unit.name == name) return unit.unit;
  }
  return std::nullopt;
}

Expected<void> make_seconds(std::vector<double>& times, std::optional<TimeUnit> unit, std::string_view name) {
  if (unit) {
    for (double& t : times) t *= of(*unit).s;
    return {};
  }
  constexpr double kFarthest_s = 1e11;
  constexpr double kLongest_s = 10.0 * 24.0 * 3600.0;
  constexpr std::size_t kMany = 200;
  constexpr double kLong_s = 4.0 * 3600.0;
  constexpr double kSlow_s = 5.0;
  const Spread spread = spread_of(times);
  const bool far = spread.farthest_s > kFarthest_s;
  const bool slow = spread.count >= kMany && spread.span_s > kLong_s && spread.interval_s > kSlow_s;
  if (!far && spread.span_s <= kLongest_s && !slow) return {};
  const NamedUnit& likely = likely_unit(spread);
  // Slow and nothing else, they may well be what they are taken for.
  const bool may_be_seconds = !far && spread.span_s <= kLongest_s;
  const std::string what = spread.span_s > kLong_s ? fmt::format("the times span {}", duration_text(spread.span_s))
                                                   : fmt::format("a time is {}", duration_text(spread.farthest_s));
  return fail(on_one_line(
      may_be_seconds
          ? fmt::format("{}: {} if they are seconds, {:.3g} s from one to the next: are they {}? A command that has "
                        "--time-unit takes them with --time-unit {}, or with --time-unit s if they are seconds",
                        name, what, spread.interval_s, likely.name, likely.name)
          : fmt::format("{}: {} if they are seconds: are they {}? Write seconds, or say --time-unit {} (or s) to a "
                        "command that has it",
                        name, what, likely.name, likely.name)));
}

}  // namespace perimap
