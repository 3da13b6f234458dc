// Progress of long work on standard error: a bar on a terminal, a line each tenth of the way elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace perimap {

class Progress {
 public:
  // `unit`: what is counted, such as "frames".
  Progress(std::string unit, std::uint64_t total);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();  // leaves the terminal's line

  void update(std::uint64_t done);

 private:
  std::string unit_;
  std::uint64_t total_;
  bool terminal_;
  bool line_open_ = false;
  std::uint64_t tenth_ = 0;
  std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point shown_{};
};

}  // namespace perimap
