// Keeps a device open: opens it, lets it be used, and opens it again after a failure.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "core/time/instant.hpp"
#include "drivers/device/device_health.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

// After a failure the device is opened again after 50 ms, then after twice that, up to half a second. A use that
// delivered samples starts the row anew.
class ReopenDelay {
 public:
  [[nodiscard]] Duration next() noexcept;
  void restart() noexcept { delay_ = kShortest; }

 private:
  static constexpr Duration kShortest = std::chrono::milliseconds(50);
  static constexpr Duration kLongest = std::chrono::milliseconds(500);
  Duration delay_ = kShortest;
};

// Opens and uses once; the device is closed on return. Why it ended, empty when it was interrupted.
template <typename Open, typename Use>
[[nodiscard]] std::string open_and_use(const Open& open, const Use& use, DeviceHealth& health) {
  auto opened = open();
  if (!opened) return std::move(opened.error().message);
  health.openings.add();
  health.set_state(DeviceState::kStarting);
  return use(*opened);
}

// Runs on the calling thread until interrupted. `open` gives an Expected<T>; `use(T&)` returns why it ended, and an
// empty text when it was interrupted: what went wrong before then stays the news. `health` tells the state and the
// reason.
template <typename Open, typename Use>
void serve_reopening(const Open& open, const Use& use, DeviceHealth& health, const Interrupt& interrupt) {
  ReopenDelay delay;
  while (!interrupt.requested()) {
    const std::uint64_t samples_before = health.samples.get();
    std::string reason = open_and_use(open, use, health);
    if (health.samples.get() > samples_before) delay.restart();
    if (!reason.empty()) health.set_reason(std::move(reason));
    health.set_state(DeviceState::kClosed);
    if (!wait_unless_interrupted(delay.next(), interrupt)) return;
  }
}

}  // namespace perimap
