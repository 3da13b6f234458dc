// What a device's own count of its samples says is missing.
#pragma once

#include <cstdint>
#include <utility>

namespace perimap {

class DeviceCount {
 public:
  // How many are missing before `count` samples, of which the first has this number. The numbers wrap, and start over
  // with the device: only a step forward is a loss.
  std::uint64_t lost_before(std::uint32_t first, std::uint32_t count) noexcept {
    const auto step = static_cast<std::int32_t>(first - next_);
    const bool lost = std::exchange(any_, true) && step > 0;
    next_ = first + count;
    return lost ? static_cast<std::uint64_t>(step) : 0;
  }

 private:
  bool any_ = false;
  std::uint32_t next_ = 0;
};

}  // namespace perimap
