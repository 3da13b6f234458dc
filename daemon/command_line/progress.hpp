// Progress of long work on standard error: a bar on a terminal, a line each tenth of the way elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "daemon/command_line/status_line.hpp"

namespace perimap {

class Progress {
 public:
  // `unit`: what is counted, such as "frames".
  Progress(const Console& console, std::string unit, std::uint64_t total);

  void update(std::uint64_t done);

 private:
  std::string unit_;
  std::uint64_t total_;
  StatusLine line_;
  std::uint64_t tenth_ = 0;
  std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point shown_{};
};

}  // namespace perimap
