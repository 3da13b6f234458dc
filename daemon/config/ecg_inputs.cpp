#include "daemon/config/ecg_inputs.hpp"

#include <fmt/format.h>

#include "drivers/ecg/bitalino.hpp"
#include "drivers/ecg/can_ecg.hpp"
#include "drivers/ecg/cyton.hpp"

namespace perimap {
namespace {

using Protocol = EcgConfiguration::Protocol;

std::optional<WrongInput> wrong_respiration(const Configuration& c) {
  const int channel = c.respiration.device_channel;
  const auto wrong = [channel](std::string expected) {
    return WrongInput{"respiration", "device_channel", std::move(expected), fmt::format("{}", channel)};
  };
  if (channel == 0) return std::nullopt;
  const auto spare = [&](int inputs, std::string_view name) -> std::optional<WrongInput> {
    const int taken = ecg_input(c.ecg);
    if (channel <= inputs && channel != taken) return std::nullopt;
    return wrong(fmt::format("1 to {} of a {}, but for {}, which carries the ECG", inputs, name, taken));
  };
  switch (c.ecg.protocol) {
    case Protocol::kBitalino:
      return spare(BitalinoProtocol::kChannels, "bitalino");
    case Protocol::kCyton:
      return spare(CytonProtocol::kChannels, "cyton");
    case Protocol::kCan:
      if (channel == kCanRespirationChannel) return std::nullopt;
      return wrong(fmt::format("{}, the second word of config/perimap_ecg.dbc", kCanRespirationChannel));
    case Protocol::kMedlab:
      return wrong("0, since a medlab tells the rate of breathing alone");
    case Protocol::kNone:
      break;
  }
  return wrong("0 without an ECG device in 'ecg.protocol'");
}

}  // namespace

int ecg_input(const EcgConfiguration& ecg) noexcept {
  if (ecg.protocol == Protocol::kBitalino) return ecg.channel > 0 ? ecg.channel : BitalinoSettings{}.channel;
  if (ecg.protocol == Protocol::kCyton) return ecg.channel > 0 ? ecg.channel : CytonSettings{}.channel;
  return 0;
}

std::optional<WrongInput> wrong_input(const Configuration& c) {
  if (c.ecg.protocol == Protocol::kBitalino && c.ecg.channel > BitalinoProtocol::kChannels) {
    return WrongInput{"ecg", "channel", fmt::format("1 to {} of a bitalino", BitalinoProtocol::kChannels),
                      fmt::format("{}", c.ecg.channel)};
  }
  if (c.ecg.r_trigger && c.ecg.r_trigger_port && c.ecg.r_trigger_port == c.ecg.port) {
    return WrongInput{"ecg", "r_trigger_port", "a serial port of its own", *c.ecg.r_trigger_port};
  }
  return wrong_respiration(c);
}

}  // namespace perimap
