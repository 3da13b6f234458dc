#include "daemon/config/ecg_inputs.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>

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
    const int second = c.ecg.second_channel;
    if (channel <= inputs && channel != taken && channel != second) return std::nullopt;
    const std::string carry =
        second > 0 ? fmt::format("{} and {}, which carry", taken, second) : fmt::format("{}, which carries", taken);
    return wrong(fmt::format("1 to {} of a {}, but for {} the ECG", inputs, name, carry));
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

std::optional<WrongInput> wrong_second_lead(const EcgConfiguration& ecg) {
  if (ecg.second_channel == 0) return std::nullopt;
  const auto wrong = [&](std::string expected) {
    return WrongInput{"ecg", "second_channel", std::move(expected), fmt::format("{}", ecg.second_channel)};
  };
  const bool bitalino = ecg.protocol == Protocol::kBitalino;
  if (!bitalino && ecg.protocol != Protocol::kCyton)
    return wrong("0 but with a bitalino or a cyton, which have inputs");
  const int inputs = bitalino ? BitalinoProtocol::kChannels : CytonProtocol::kChannels;
  const int first = ecg_input(ecg);
  if (ecg.second_channel <= inputs && ecg.second_channel != first) return std::nullopt;
  return wrong(fmt::format("1 to {} of a {}, but for {}, which carries the first lead", inputs,
                           bitalino ? "bitalino" : "cyton", first));
}

}  // namespace

int ecg_input(const EcgConfiguration& ecg) noexcept {
  if (ecg.protocol == Protocol::kBitalino) return ecg.channel > 0 ? ecg.channel : BitalinoSettings{}.channel;
  if (ecg.protocol == Protocol::kCyton) return ecg.channel > 0 ? ecg.channel : CytonSettings{}.channel;
  return 0;
}

std::vector<WrongInput> wrong_inputs(const Configuration& c) {
  std::vector<WrongInput> all;
  if (c.ecg.protocol == Protocol::kBitalino && c.ecg.channel > BitalinoProtocol::kChannels) {
    all.push_back({"ecg", "channel", fmt::format("1 to {} of a bitalino", BitalinoProtocol::kChannels),
                   fmt::format("{}", c.ecg.channel)});
  }
  if (c.ecg.r_trigger && c.ecg.r_trigger_port && c.ecg.r_trigger_port == c.ecg.port) {
    all.push_back({"ecg", "r_trigger_port", "a serial port of its own", *c.ecg.r_trigger_port});
  }
  if (auto wrong = wrong_second_lead(c.ecg)) all.push_back(*std::move(wrong));
  if (auto wrong = wrong_respiration(c)) all.push_back(*std::move(wrong));
  return all;
}

}  // namespace perimap
