#include "daemon/runtime/device_news.hpp"

#include <fmt/format.h>

namespace perimap {

std::optional<DeviceNews::Line> DeviceNews::next(DeviceState state, const std::string& reason,
                                                 const std::string& identity, Instant now) {
  earn(now);
  const Seen seen{state, reason};
  if (seen != seen_) ++changes_;
  seen_ = seen;
  if (changes_ == 0 || lines_left_ == 0) return std::nullopt;
  std::optional<Line> told = line(identity);
  if (told && changes_ > 1) told->text += fmt::format(" ({} changes before that are not told)", changes_ - 1);
  if (told) --lines_left_;
  told_ = seen_;
  changes_ = 0;
  return told;
}

std::optional<std::string> DeviceNews::note(const std::string& notice) {
  // While a device is opened anew it has none; the same one afterwards is no news.
  if (notice.empty() || notice == noted_) return std::nullopt;
  noted_ = notice;
  return fmt::format("{}: {}", name_, notice);
}

void DeviceNews::earn(Instant now) {
  while (lines_left_ < kAtOnce && now - earned_ >= kEvery) {
    ++lines_left_;
    earned_ += kEvery;
  }
  if (lines_left_ == kAtOnce) earned_ = now;
}

std::optional<DeviceNews::Line> DeviceNews::line(const std::string& identity) const {
  const auto& [state, reason] = seen_;
  const bool same_reason = reason == told_.reason;
  if (seen_ == told_) return Line{false, fmt::format("{}: as before", name_)};
  if (state == told_.state && state != DeviceState::kClosed) {
    // What the device tells while it is open, such as a controller off its bus.
    if (reason.empty() && changes_ == 1) return std::nullopt;
    return Line{true, fmt::format("{}: {}", name_, reason.empty() ? device_state_name(state) : reason)};
  }
  if (state == DeviceState::kStreaming) {
    return Line{false, fmt::format("{}: streaming{}{}", name_, identity.empty() ? "" : ": ", identity)};
  }
  if (state == DeviceState::kClosed) {
    return Line{true, fmt::format("{}: {}", name_, reason.empty() ? "closed" : reason)};
  }
  const bool news = !same_reason && !reason.empty();
  return Line{false, fmt::format("{}: {}{}", name_, device_state_name(state), news ? ": " + reason : "")};
}

}  // namespace perimap
