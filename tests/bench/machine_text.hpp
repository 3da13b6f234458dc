// What a benchmark ran on.
#pragma once

#include <sys/utsname.h>

#include <cstdio>
#include <fstream>
#include <string>
#include <thread>

#include "core/simd/simd_target.hpp"

namespace perimap::bench {

inline std::string line_after(const char* path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.rfind(key, 0) == 0) return line.substr(line.find(':') + 1);
  }
  return " unknown";
}

inline void print_machine(const char* revision) {
  utsname system{};
  uname(&system);
  std::string governor;
  std::ifstream("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor") >> governor;
  std::string load;
  std::ifstream load_file("/proc/loadavg");
  std::getline(load_file, load);
  std::printf("machine:%s, %u processors, governor %s, %s %s\n", line_after("/proc/cpuinfo", "model name").c_str(),
              std::thread::hardware_concurrency(), governor.empty() ? "unknown" : governor.c_str(), system.sysname,
              system.release);
  std::printf("built: GCC-compatible %s, revision %s; kernels on %s; load %s\n", __VERSION__, revision,
              simd_target_name(best_simd_target()), load.c_str());
}

}  // namespace perimap::bench
