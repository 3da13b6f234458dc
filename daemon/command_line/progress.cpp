#include "daemon/command_line/progress.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace perimap {

Progress::Progress(const Console& console, std::string unit, std::uint64_t total)
    : unit_(std::move(unit)),
      total_(std::max<std::uint64_t>(total, 1)),
      line_(console),
      begin_(std::chrono::steady_clock::now()) {}

void Progress::update(std::uint64_t done) {
  const auto now = std::chrono::steady_clock::now();
  const double elapsed_s = std::chrono::duration<double>(now - begin_).count();
  const double per_s = static_cast<double>(done) / std::max(elapsed_s, 1e-3);
  const double left_s = static_cast<double>(total_ - std::min(done, total_)) / std::max(per_s, 1e-9);
  const auto line = [&] {
    return fmt::format("{:3}% {}/{} {}, {:.0f} {}/s, {:.0f} s left", 100 * done / total_, done, total_, unit_, per_s,
                       unit_, done == 0 ? 0.0 : left_s);
  };
  if (line_.on_terminal()) {
    if (done < total_ && now - shown_ < std::chrono::milliseconds(200)) return;
    shown_ = now;
    constexpr std::uint64_t kWidth = 30;
    const auto filled = static_cast<std::size_t>(std::min(kWidth, kWidth * done / total_));
    line_.show(fmt::format("[{}{}] {}", std::string(filled, '#'), std::string(kWidth - filled, '.'), line()));
  } else if (10 * done / total_ > tenth_) {
    tenth_ = 10 * done / total_;
    line_.show(line());
  }
}

}  // namespace perimap
