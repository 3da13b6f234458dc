#include "drivers/ecg/bitalino.hpp"

#include <array>
#include <utility>

namespace perimap {
namespace {

constexpr std::size_t kFramesToSynchronise = 4;
constexpr std::size_t kFramesToBelieve = 2;
constexpr unsigned kSequenceModulus = 16;
constexpr int kFullScale = 1023;
// ECG sensor: (sample / 2^10 - 1/2) * 3.3 V / 1100.
constexpr double kSupply_mV = 3300.0;
constexpr double kSensorGain = 1100.0;

unsigned sequence_of(std::span<const std::byte> frame) { return std::to_integer<unsigned>(frame[2]) >> 4U; }
bool passes_check(std::span<const std::byte> frame) {
  return (std::to_integer<unsigned>(frame[2]) & 0xFU) == bitalino_crc(frame);
}

constexpr FrameShape kShape{
    .bytes = BitalinoProtocol::kFrameBytes,
    .modulus = kSequenceModulus,
    .to_synchronise = kFramesToSynchronise,
    .to_believe = kFramesToBelieve,
    .well_formed = &passes_check,
    .count = &sequence_of,
};

}  // namespace

std::uint8_t bitalino_crc(std::span<const std::byte> frame) noexcept {
  constexpr std::array<std::uint8_t, 16> kTable{0, 3, 6, 5, 12, 15, 10, 9, 11, 8, 13, 14, 7, 4, 1, 2};
  unsigned crc = 0;
  const auto add = [&](unsigned nibble) { crc = kTable[crc] ^ nibble; };
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const auto value = std::to_integer<unsigned>(frame[i]);
    add(value >> 4U);
    if (i + 1 < frame.size()) add(value & 0xFU);
  }
  return kTable[crc];
}

BitalinoProtocol::BitalinoProtocol(const BitalinoSettings& settings, EcgSink sink, DeviceHealth& health)
    : EcgProtocol(kSampleRate_hz, time_on_line(kFrameBytes, kBaud) + from_seconds(1.0 / kSampleRate_hz),
                  std::move(sink), health),
      settings_(settings),
      framer_(kShape) {}

void BitalinoProtocol::start(LinkControl& link) {
  framer_.restart();
  rail_.restart();
  const auto channels = static_cast<std::uint8_t>(1U << static_cast<unsigned>(settings_.channel - 1));
  const std::array<std::byte, 3> commands{std::byte{0x00}, std::byte{0xC3},
                                          static_cast<std::byte>((channels << 2U) | 0x01U)};
  link.send(commands);
}

void BitalinoProtocol::decode(LinkControl& /*link*/, std::span<const std::byte> bytes, Instant arrival) {
  const auto take = [&](std::span<const std::byte> frame, std::optional<unsigned> lost, std::size_t behind) {
    const int value = static_cast<int>((std::to_integer<unsigned>(frame[1]) & 0xFU) << 6U) |
                      static_cast<int>(std::to_integer<unsigned>(frame[0]) >> 2U);
    const bool off = rail_.lead_off(value == 0 || value == kFullScale);
    samples().add(static_cast<float>((value / 1024.0 - 0.5) * kSupply_mV / kSensorGain), off,
                  lost ? samples().lost_samples(*lost, kSequenceModulus, behind, arrival) : 0);
  };
  health().damaged.add(framer_.feed(bytes, take));
}

}  // namespace perimap
