#include "daemon/command_line/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace perimap {

Progress::Progress(std::string unit, std::uint64_t total)
    : unit_(std::move(unit)),
      total_(std::max<std::uint64_t>(total, 1)),
      terminal_(isatty(STDERR_FILENO) == 1),
      begin_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (line_open_) fmt::print(stderr, "\n");
}

void Progress::update(std::uint64_t done) {
  const auto now = std::chrono::steady_clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - begin_).count();
  const double per_s = static_cast<double>(done) / std::max(elapsed_s, 1e-3);
  const double left_s = static_cast<double>(total_ - std::min(done, total_)) / std::max(per_s, 1e-9);
  const auto line = [&] {
    return fmt::format("{:3}% {}/{} {}, {:.0f} {}/s, {:.0f} s left", 100 * done / total_, done, total_, unit_, per_s,
                       unit_, done == 0 ? 0.0 : left_s);
  };
  if (terminal_) {
    if (done < total_ && now - shown_ < std::chrono::milliseconds(200)) return;
    shown_ = now;
    constexpr std::uint64_t kWidth = 30;
    const auto filled = static_cast<std::size_t>(std::min(kWidth, kWidth * done / total_));
    fmt::print(stderr, "\r[{}{}] {}\x1b[K", std::string(filled, '#'), std::string(kWidth - filled, '.'), line());
    line_open_ = true;
  } else if (10 * done / total_ > tenth_) {
    tenth_ = 10 * done / total_;
    fmt::print(stderr, "{}\n", line());
  }
  (void)std::fflush(stderr);
}

}  // namespace perimap
