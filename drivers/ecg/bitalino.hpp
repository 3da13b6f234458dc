// BITalino (PLUX): frame and commands as in the public "BITalino (r)evolution Board Data Sheet" and its open API.
//
// 115200 8N1. Commands are a byte: 0x00 idle; 0x07 in idle: the firmware's name ("BITalino_v5.2") and a line feed;
// 0x03 0x43 0x83 0xC3 sample at 1, 10, 100, 1000 Hz; (mask << 2) | 1 starts live acquisition of the channels in the
// mask. One, two or three analogue channels make frames of three, four or six bytes:
//
//                                 vvvvvv00  IIIIVVVV  ssssCCCC    v, V: low six and high four bits of a 10-bit
//                                                                 sample; I: digital lines
//                       wwwwwwww  vvvvvvWW  IIIIVVVV  ssssCCCC    w, W: likewise eight and two bits of the channel
//                                                                 with the next higher number
//   xx000000  XXXXXXXX  wwwwwwww  vvvvvvWW  IIIIVVVV  ssssCCCC    x, X: likewise two and eight bits of a third
//                                                                 s: sequence modulo 16
//                                                                 C: CRC-4 over all but itself (x^4 + x + 1)
//
// A check of four bits lets one in sixteen garbled frames pass. So synchronisation needs four frames in a row that
// follow each other, and a frame counts only when the next agrees with it; that costs a millisecond.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/ecg/counted_framer.hpp"
#include "drivers/ecg/ecg_protocol.hpp"
#include "drivers/ecg/rail_watch.hpp"

namespace perimap {

struct BitalinoSettings {
  int channel = 2;              // A1 to A6; the kits have the ECG on A2
  int second_channel = 0;       // A1 to A6, another: a second lead of the ECG; 0: none
  int respiration_channel = 0;  // A1 to A6, another; 0: none
};

// CRC-4 of a frame whose last nibble, the check itself, is left out.
[[nodiscard]] std::uint8_t bitalino_crc(std::span<const std::byte> frame) noexcept;

// Of one to three channels.
[[nodiscard]] constexpr std::size_t bitalino_frame_bytes(std::size_t channels) noexcept {
  return channels < 3 ? channels + 2 : 6;
}
// The 10-bit samples of a frame, in order of channel; 0 of those that it does not have.
[[nodiscard]] std::array<int, 3> bitalino_samples(std::span<const std::byte> frame) noexcept;

class BitalinoProtocol final : public EcgProtocol {
 public:
  static constexpr int kBaud = 115200;
  static constexpr double kSampleRate_hz = 1000.0;
  static constexpr int kChannels = 6;

  BitalinoProtocol(const BitalinoSettings& settings, EcgSinks sinks, DeviceHealth& health);

 protected:
  void start() override;
  void decode(LinkControl& link, std::span<const std::byte> bytes, Instant arrival) override;

 private:
  // What is left of the bytes that begin a session when the firmware's name has been taken off.
  [[nodiscard]] std::span<const std::byte> after_name(std::span<const std::byte> bytes);

  BitalinoSettings settings_;
  CountedFramer framer_;
  bool named_ = false;            // the name has come, or what came is none
  std::vector<std::byte> begun_;  // until then
  RailWatch lead_{kSampleRate_hz, RailWatch::kLeadOff_s};
  RailWatch second_lead_{kSampleRate_hz, RailWatch::kLeadOff_s};
  RailWatch breath_sensor_{kSampleRate_hz, RailWatch::kSensorOff_s};
};

}  // namespace perimap
