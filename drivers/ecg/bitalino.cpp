#include "drivers/ecg/bitalino.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <string>
#include <string_view>
#include <utility>

namespace perimap {
namespace {

constexpr std::size_t kFramesToSynchronise = 4;
constexpr std::size_t kFramesToBelieve = 2;
constexpr unsigned kSequenceModulus = 16;
constexpr std::string_view kName = "BITalino";
constexpr std::size_t kLongestName = 40;
constexpr int kFullScale = 1023;
// The open API waits so long after each; a board takes no second one sooner.
constexpr Duration kBetweenCommands = std::chrono::milliseconds(150);
// ECG sensor: (sample / 2^10 - 1/2) * 3.3 V / 1100.
constexpr double kSupply_mV = 3300.0;
constexpr double kSensorGain = 1100.0;

constexpr double kCount_mV = kSupply_mV / 1024.0;

unsigned sequence_of(std::span<const std::byte> frame) { return std::to_integer<unsigned>(frame.back()) >> 4U; }
bool passes_check(std::span<const std::byte> frame) {
  return (std::to_integer<unsigned>(frame.back()) & 0xFU) == bitalino_crc(frame);
}
bool at_rail(int value) { return value == 0 || value == kFullScale; }

std::size_t frame_bytes(const BitalinoSettings& settings) {
  return bitalino_frame_bytes(1U + (settings.second_channel > 0 ? 1U : 0U) +
                              (settings.respiration_channel > 0 ? 1U : 0U));
}

FrameShape shape(const BitalinoSettings& settings) {
  return {.bytes = frame_bytes(settings),
          .modulus = kSequenceModulus,
          .to_synchronise = kFramesToSynchronise,
          .to_believe = kFramesToBelieve,
          .well_formed = &passes_check,
          .count = &sequence_of};
}

// Of the channel, from 1.
unsigned mask(int channel) { return channel > 0 ? 1U << static_cast<unsigned>(channel - 1) : 0U; }
unsigned mask(const BitalinoSettings& settings) {
  return mask(settings.channel) | mask(settings.second_channel) | mask(settings.respiration_channel);
}

// Where a channel's sample stands among those of a frame: they are in order of channel.
std::size_t place_of(int channel, const BitalinoSettings& settings) {
  return static_cast<std::size_t>(std::popcount(mask(settings) & (mask(channel) - 1U)));
}

float lead_value(int value) { return static_cast<float>((value - 512) * kCount_mV / kSensorGain); }

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

std::array<int, 3> bitalino_samples(std::span<const std::byte> frame) noexcept {
  const auto byte = [&frame](std::size_t from_end) { return std::to_integer<int>(frame[frame.size() - 1 - from_end]); };
  const int first = (byte(1) & 0xF) << 6 | byte(2) >> 2;
  const int second = frame.size() >= bitalino_frame_bytes(2) ? (byte(2) & 0x3) << 8 | byte(3) : 0;
  const int third = frame.size() >= bitalino_frame_bytes(3) ? byte(4) << 2 | byte(5) >> 6 : 0;
  return {first, second, third};
}

// A frame waits for the next to agree with it.
BitalinoProtocol::BitalinoProtocol(const BitalinoSettings& settings, EcgSinks sinks, DeviceHealth& health)
    : EcgProtocol(kSampleRate_hz, time_on_line(frame_bytes(settings), kBaud) + from_seconds(1.0 / kSampleRate_hz),
                  std::move(sinks), health),
      settings_(settings),
      framer_(shape(settings)) {}

void BitalinoProtocol::start() {
  framer_.restart();
  lead_.restart();
  second_lead_.restart();
  breath_sensor_.restart();
  named_ = false;
  begun_.clear();
  const std::array<std::byte, 4> commands{std::byte{0x00}, std::byte{0x07}, std::byte{0xC3},
                                          static_cast<std::byte>(mask(settings_) << 2U | 0x01U)};
  for (std::size_t i = 0; i < commands.size(); ++i) {
    send_in(i == 0 ? Duration(0) : kBetweenCommands, std::span(commands).subspan(i, 1));
  }
}

// A board that does not tell its name begins with frames, and so does one that was streaming still.
std::span<const std::byte> BitalinoProtocol::after_name(std::span<const std::byte> bytes) {
  if (named_) return bytes;
  begun_.insert(begun_.end(), bytes.begin(), bytes.end());
  const std::string_view text(reinterpret_cast<const char*>(begun_.data()), begun_.size());
  const std::size_t common = std::min(text.size(), kName.size());
  const bool may_be_name = text.substr(0, common) == kName.substr(0, common);
  const std::size_t end = may_be_name ? text.find('\n') : std::string_view::npos;
  if (may_be_name && end == std::string_view::npos && text.size() < kLongestName) return {};
  named_ = true;
  if (end >= kLongestName) return begun_;  // or none
  health().set_identity(std::string(text.substr(0, end)));
  return std::span(begun_).subspan(end + 1);
}

void BitalinoProtocol::decode(LinkControl& /*link*/, std::span<const std::byte> bytes, Instant arrival) {
  const auto take = [&](std::span<const std::byte> frame, std::optional<unsigned> lost, std::size_t behind) {
    const std::array<int, 3> values = bitalino_samples(frame);
    const auto value_of = [&](int channel) { return values[place_of(channel, settings_)]; };
    const int ecg = value_of(settings_.channel);
    std::optional<SecondLead> second;
    if (settings_.second_channel > 0) {
      const int value = value_of(settings_.second_channel);
      second = {lead_value(value), second_lead_.off(at_rail(value))};
    }
    std::optional<RespirationReading> respiration;
    if (settings_.respiration_channel > 0) {
      const int value = value_of(settings_.respiration_channel);
      respiration = {static_cast<float>((value - 512) * kCount_mV), breath_sensor_.off(at_rail(value))};
    }
    samples().add(lead_value(ecg), lead_.off(at_rail(ecg)),
                  lost ? samples().lost_samples(*lost, kSequenceModulus, behind, arrival) : 0, respiration, second);
  };
  health().damaged.add(framer_.feed(after_name(bytes), take));
}

}  // namespace perimap
