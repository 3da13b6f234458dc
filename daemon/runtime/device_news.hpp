// What the log says of a device.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/time/instant.hpp"
#include "drivers/device/device_health.hpp"

namespace perimap {

// A line when state or reason have changed. Of a device that changes all the time some lines are told, then one every
// kEvery, with the number of the changes between; what it is in the end is always told.
class DeviceNews {
 public:
  static constexpr int kAtOnce = 100;
  static constexpr Duration kEvery = std::chrono::seconds(10);

  struct Line {
    bool warning = false;
    std::string text;
  };

  explicit DeviceNews(std::string name) : name_(std::move(name)) {}

  // Some times a second, `now` rising: the line that is due, if any. `identity` is what the device says that it is.
  [[nodiscard]] std::optional<Line> next(DeviceState state, const std::string& reason, const std::string& identity,
                                         Instant now);
  // What the device is used in spite of, when that is news.
  [[nodiscard]] std::optional<std::string> note(const std::string& notice);

 private:
  struct Seen {
    DeviceState state = DeviceState::kClosed;
    std::string reason;
    bool operator==(const Seen&) const = default;
  };

  void earn(Instant now);
  [[nodiscard]] std::optional<Line> line(const std::string& identity) const;

  std::string name_;
  Seen seen_;  // last
  Seen told_;
  std::string noted_;
  std::uint64_t changes_ = 0;  // since told_
  int lines_left_ = kAtOnce;
  Instant earned_;  // the last of them, or when all were there
};

}  // namespace perimap
