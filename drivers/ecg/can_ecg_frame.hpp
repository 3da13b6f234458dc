// An ECG over CAN. There is no convention for it, so this is the project's own, also in config/perimap_ecg.dbc.
//
//   byte 0     count of frames, modulo 256
//   byte 1     bit 0 lead off, bit 1 an R peak was detected since the last frame, bit 7 only the first sample counts,
//              bit 2 the second sample is one of respiration, taken with the first, bit 3 its sensor is off
//   bytes 2-3  device time of the first sample, ms modulo 65536, little-endian
//   bytes 4-5  first sample, signed, little-endian
//   bytes 6-7  second sample, one period later, or respiration
//
// Identifier, sample rate and mV per count are configured.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/transport/can_socket.hpp"

namespace perimap {

struct CanEcgFrame {
  std::uint8_t count = 0;
  bool lead_off = false;
  bool r_peak = false;
  int samples = 2;  // of the ECG, 1 or 2; 1 with respiration
  std::uint16_t device_time_ms = 0;
  std::array<std::int16_t, 2> values{};
  bool respiration = false;  // values[1] is of the respiration channel
  bool respiration_off = false;

  bool operator==(const CanEcgFrame&) const = default;
};

// None when the frame is of another identifier or not eight bytes long.
[[nodiscard]] std::optional<CanEcgFrame> decode_can_ecg(const CanFrame& frame, std::uint32_t identifier,
                                                        bool extended) noexcept;
[[nodiscard]] CanFrame encode_can_ecg(const CanEcgFrame& ecg, std::uint32_t identifier, bool extended) noexcept;

}  // namespace perimap
