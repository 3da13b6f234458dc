#include "drivers/ecg/medlab.hpp"

#include <array>
#include <utility>

namespace perimap {
namespace {

constexpr std::uint8_t kLargestValue = 0xF6;
constexpr std::uint8_t kWaveFollows = 0xF8;
constexpr std::uint8_t kRespirationFollows = 0xF9;
constexpr std::uint8_t kPulseFollows = 0xFA;
constexpr std::uint8_t kInfoFollows = 0xFB;
constexpr std::uint8_t kLeadOff = 0x11;
constexpr int kNeutral = 128;

}  // namespace

MedlabProtocol::MedlabProtocol(const MedlabSettings& settings, EcgSinks sinks, DeviceHealth& health)
    : EcgProtocol(kSampleRate_hz, time_on_line(1, kBaud), std::move(sinks), health), settings_(settings) {}

void MedlabProtocol::start() {
  follows_ = Follows::kNothing;
  lead_off_ = false;
  const std::array<char, 5> commands{'N', 'S', '0', 'G', settings_.lead};
  send_in(Duration(0), std::string_view(commands.data(), commands.size()));
}

void MedlabProtocol::decode(LinkControl& /*link*/, std::span<const std::byte> bytes, Instant /*arrival*/) {
  for (const std::byte b : bytes) {
    const auto value = std::to_integer<std::uint8_t>(b);
    if (value > kLargestValue) {
      switch (value) {
        case kWaveFollows:
          follows_ = Follows::kWave;
          break;
        case kRespirationFollows:
          follows_ = Follows::kRespiration;
          break;
        case kPulseFollows:
          follows_ = Follows::kPulse;
          break;
        case kInfoFollows:
          follows_ = Follows::kInfo;
          break;
        default:
          follows_ = Follows::kNothing;
          health().damaged.add();
      }
      continue;
    }
    switch (std::exchange(follows_, follows_ == Follows::kWave ? Follows::kWave : Follows::kNothing)) {
      case Follows::kWave:
        samples().add(static_cast<float>((value - kNeutral) * settings_.count_mV), lead_off_);
        break;
      case Follows::kPulse:
        // The module has no word for leads that are on again, but it finds a pulse on no other.
        if (value > 0) lead_off_ = false;
        break;
      case Follows::kInfo:
        if (value == kLeadOff) lead_off_ = true;
        break;
      case Follows::kRespiration:
        break;
      case Follows::kNothing:
        health().damaged.add();
    }
  }
}

}  // namespace perimap
