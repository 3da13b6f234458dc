#include "daemon/bench/ddsperf_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/statistics/upper_median.hpp"
#include "daemon/bench/child_process.hpp"

namespace perimap::bench {
namespace {

double median(std::vector<double> values) { return upper_median(values.begin(), values.end()); }

}  // namespace

std::optional<DdsperfSecond> parse_ddsperf_line(const std::string& line) {
  const auto begin = line.find(" mean ");
  if (begin == std::string::npos) return std::nullopt;
  DdsperfSecond second;
  const int read =
      std::sscanf(line.c_str() + begin, " mean %*fus min %*fus 50%% %lfus 90%% %*fus 99%% %lfus max %lfus cnt %d",
                  &second.p50_us, &second.p99_us, &second.max_us, &second.count);
  if (read != 4) return std::nullopt;
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
