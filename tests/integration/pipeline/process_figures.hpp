// What a process holds, and how times are told of it.
#pragma once

#include <fmt/format.h>
#include <sys/types.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "core/time/instant.hpp"

namespace perimap::test {

inline long descriptors_of(pid_t pid) {
  return std::distance(std::filesystem::directory_iterator(fmt::format("/proc/{}/fd", pid)),
                       std::filesystem::directory_iterator());
}

// 0: there is no such process.
// Of its own: the pages of programs and libraries come and go as the kernel likes.
inline long own_memory_kB_of(pid_t pid) {
  std::ifstream status(fmt::format("/proc/{}/status", pid));
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("RssAnon:")) return std::strtol(line.c_str() + 8, nullptr, 10);
  }
  return 0;
}

inline std::string spread(std::vector<Duration> times) {
  if (times.empty()) return "never";
  std::sort(times.begin(), times.end());
  return fmt::format("{:.0f} ms (median), {:.0f} ms (longest)", 1e3 * to_seconds(times[times.size() / 2]),
                     1e3 * to_seconds(times.back()));
}

}  // namespace perimap::test
