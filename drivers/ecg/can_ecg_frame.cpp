#include "drivers/ecg/can_ecg_frame.hpp"

namespace perimap {
namespace {

constexpr std::uint8_t kLength = 8;
constexpr unsigned kLeadOff = 0x01;
constexpr unsigned kRPeak = 0x02;
constexpr unsigned kRespiration = 0x04;
constexpr unsigned kRespirationOff = 0x08;
constexpr unsigned kOneSample = 0x80;

}  // namespace

std::optional<CanEcgFrame> decode_can_ecg(const CanFrame& frame, std::uint32_t identifier, bool extended) noexcept {
  if (frame.error || frame.identifier != identifier || frame.extended != extended || frame.length != kLength) {
    return std::nullopt;
  }
  const auto word = [&frame](std::size_t at) {
    return static_cast<std::uint16_t>(frame.data[at] | static_cast<unsigned>(frame.data[at + 1]) << 8U);
  };
  CanEcgFrame ecg;
  ecg.count = frame.data[0];
  ecg.lead_off = (frame.data[1] & kLeadOff) != 0;
  ecg.r_peak = (frame.data[1] & kRPeak) != 0;
  ecg.respiration = (frame.data[1] & kRespiration) != 0;
  ecg.respiration_off = (frame.data[1] & kRespirationOff) != 0;
  ecg.samples = (frame.data[1] & kOneSample) != 0 || ecg.respiration ? 1 : 2;
  ecg.device_time_ms = word(2);
  ecg.values = {static_cast<std::int16_t>(word(4)), static_cast<std::int16_t>(word(6))};
  return ecg;
}

CanFrame encode_can_ecg(const CanEcgFrame& ecg, std::uint32_t identifier, bool extended) noexcept {
  CanFrame frame;
  frame.identifier = identifier;
  frame.extended = extended;
  frame.length = kLength;
  frame.data[0] = ecg.count;
  frame.data[1] = static_cast<std::uint8_t>(
      (ecg.lead_off ? kLeadOff : 0U) | (ecg.r_peak ? kRPeak : 0U) | (ecg.respiration ? kRespiration : 0U) |
      (ecg.respiration_off ? kRespirationOff : 0U) | (ecg.samples == 1 && !ecg.respiration ? kOneSample : 0U));
  const auto put = [&frame](std::size_t at, std::uint16_t value) {
    frame.data[at] = static_cast<std::uint8_t>(value & 0xFFU);
    frame.data[at + 1] = static_cast<std::uint8_t>(value >> 8U);
  };
  put(2, ecg.device_time_ms);
  put(4, static_cast<std::uint16_t>(ecg.values[0]));
  put(6, static_cast<std::uint16_t>(ecg.values[1]));
  return frame;
}

}  // namespace perimap
