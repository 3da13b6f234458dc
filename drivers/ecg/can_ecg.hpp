// ECG from SocketCAN: frames of can_ecg_frame.hpp with the kernel's receive stamps.
#pragma once

#include <optional>
#include <string>

#include "drivers/device/rate_check.hpp"
#include "drivers/ecg/can_ecg_frame.hpp"
#include "drivers/ecg/ecg_assembler.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

struct CanEcgSettings {
  static constexpr std::uint32_t kLargestStandardIdentifier = 0x7FF;  // of 11 bits; an extended one has 29

  std::uint32_t identifier = 0x2E0;
  bool extended = false;
  double sample_rate_hz = 360.0;
  double count_mV = 0.005;
};

// The input that a frame's second word carries when it is of respiration; the first is the ECG.
inline constexpr int kCanRespirationChannel = 2;

// What a frame does; no socket. Frame counts tell lost frames modulo 256; the device's own time says how often that
// went round (a minute, then again the host's clock). Samples that come at another rate than the settings say are not
// taken, since their stamps would be wrong.
class CanEcgDecoder {
 public:
  CanEcgDecoder(const CanEcgSettings& settings, EcgSinks sinks, DeviceHealth& health);

  void restart() noexcept;
  void decode_frame(const CanFrame& frame);
  // After every wait and every frame of whatever kind: whether samples come still.
  void watch(Instant now) noexcept;

 private:
  // Whether samples come at the rate that the stamps are made by; tells when that changes.
  bool expect_rate(Instant arrival);
  [[nodiscard]] std::uint64_t lost_before(const CanEcgFrame& ecg, Instant arrival) const noexcept;

  CanEcgSettings settings_;
  EcgAssembler samples_;
  DeviceHealth& health_;
  RateCheck rate_;
  bool rate_refused_ = false;
  std::int64_t device_count_ = 0;  // samples, by the device's own count
  std::optional<CanEcgFrame> last_;
  Instant last_arrival_{};
  std::uint32_t dropped_ = 0;
  std::uint64_t watched_samples_ = 0;
};

// Reads until interrupted; reopens when the interface went down or away.
void serve_can_ecg(const std::string& interface_name, const CanEcgSettings& settings, const EcgSinks& sinks,
                   DeviceHealth& health, const Interrupt& interrupt);

}  // namespace perimap
