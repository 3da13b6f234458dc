// What an emulated device does wrong, on request.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "core/time/instant.hpp"
#include "drivers/device/device_protocol.hpp"

namespace perimap {

struct EmulatorFaults {
  // Each a probability for a message.
  double bad_check = 0.0;  // its check sum is wrong; where a protocol has none, a byte is
  double garbled = 0.0;    // one of its bytes is another
  double truncated = 0.0;  // its end is missing
  double lost = 0.0;       // it is missing altogether
  double drift_ppm = 0.0;  // the device's clock runs fast by this
  // Every so often for so long; 0: never. Counted from the device's start.
  Duration missing_every{0}, missing_for{0};  // the tool is out of sight, the lead is off
  Duration unplug_every{0}, unplug_for{0};    // the link is cut
  std::uint64_t seed = 1;

  [[nodiscard]] bool missing(Duration since_start) const noexcept {
    return missing_every > Duration(0) && since_start % missing_every >= missing_every - missing_for;
  }
};

// Sends messages, each wrong or not by its dice.
class FaultySender {
 public:
  explicit FaultySender(const EmulatorFaults& faults) : faults_(faults), random_(faults.seed) {}

  // `check`: index of the byte to damage for a bad check sum.
  void send(LinkControl& link, std::span<const std::byte> message, std::size_t check) {
    if (message.empty() || happens(faults_.lost)) return;
    bytes_.assign(message.begin(), message.end());
    if (happens(faults_.bad_check)) bytes_[check] ^= std::byte{1};
    if (happens(faults_.garbled)) {
      // Never xor by zero: it is to be another byte.
      bytes_[random_() % bytes_.size()] ^= static_cast<std::byte>(1 + random_() % 255);
    }
    if (happens(faults_.truncated)) bytes_.resize(random_() % bytes_.size());
    link.send(bytes_);
  }

 private:
  bool happens(double probability) {
    return probability > 0.0 && std::uniform_real_distribution<>(0.0, 1.0)(random_) < probability;
  }

  EmulatorFaults faults_;
  std::mt19937_64 random_;
  std::vector<std::byte> bytes_;
};

}  // namespace perimap
