#include "daemon/evaluation/bench/ddsperf_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <system_error>

#include "core/statistics/upper_median.hpp"
#include "daemon/evaluation/bench/child_process.hpp"

namespace perimap::bench {
namespace {

// The number behind `name` and before `unit`; leaves what follows.
template <class Number>
bool take_number(std::string_view& rest, std::string_view name, std::string_view unit, Number& number) {
  const auto found = rest.find(name);
  if (found == std::string_view::npos) return false;
  rest.remove_prefix(found + name.size());
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error != std::errc{}) return false;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  if (!rest.starts_with(unit)) return false;
  rest.remove_prefix(unit.size());
  return true;
}

double median(std::vector<double> values) { return upper_median(values.begin(), values.end()); }

}  // namespace

std::optional<DdsperfSecond> parse_ddsperf_line(const std::string& line) {
  std::string_view rest = line;
  DdsperfSecond second;
  const bool told = take_number(rest, " 50% ", "us ", second.p50_us) &&
                    take_number(rest, "99% ", "us ", second.p99_us) &&
                    take_number(rest, "max ", "us ", second.max_us) && take_number(rest, "cnt ", "", second.count);
  if (!told) return std::nullopt;
  return second;
}

DdsperfResult run_ddsperf(int domain, std::size_t bytes, double rate_hz, Duration length, const std::string& beside) {
  DdsperfResult result;
  result.beside = beside;
  result.bytes = bytes;
  const auto program = find_program("ddsperf");
  if (!program) {
    result.not_run = "ddsperf is not installed (package cyclonedds-tools)";
    return result;
  }
  const auto seconds = static_cast<int>(std::lround(to_seconds(length))) + 2;
  const auto arguments = [&](int duration, std::vector<std::string> mode) {
    std::vector<std::string> all = {"-u", "-i", std::to_string(domain), "-D", std::to_string(duration)};
    all.insert(all.end(), mode.begin(), mode.end());
    return all;
  };
  auto pong = ChildProcess::start(*program, arguments(seconds + 5, {"pong", "waitset"}));
  auto ping = ChildProcess::start(*program, arguments(seconds, {"ping", fmt::format("{:.0f}Hz", rate_hz), "size",
                                                                std::to_string(bytes), "waitset"}));
  if (!pong || !ping) {
    result.not_run = (pong ? ping.error() : pong.error()).message;
    return result;
  }
  std::vector<double> p50;
  std::vector<double> p99;
  bool first = true;
  for (const std::string& line : ping->read_lines()) {
    const auto second = parse_ddsperf_line(line);
    if (!second) continue;
    if (!std::exchange(first, false)) {
      p50.push_back(second->p50_us);
      p99.push_back(second->p99_us);
      result.max_us = std::max(result.max_us, second->max_us);
      result.count += second->count;
    }
  }
  if (p50.empty()) {
    result.not_run = "ddsperf gave no figures";
    return result;
  }
  result.p50_us = median(p50);
  result.p99_us = median(p99);
  return result;
}

}  // namespace perimap::bench
