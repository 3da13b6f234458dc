#include "drivers/emulator/can_ecg_emulator.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "drivers/transport/can_socket.hpp"

namespace perimap {

Expected<void> emulate_can_ecg(const std::string& interface_name, const EcgWaveform& waveform,
                               const CanEcgSettings& settings, const EmulatorFaults& faults,
                               const Interrupt& interrupt) {
  // Listens to no identifier of use: this end only sends.
  auto socket = CanSocket::open(interface_name, settings.identifier, settings.extended);
  if (!socket) return tl::unexpected(std::move(socket.error()));
  std::mt19937_64 random(faults.seed);
  std::uniform_real_distribution<> dice(0.0, 1.0);
  const double period_ns = 1e9 / settings.sample_rate_hz / (1.0 + 1e-6 * faults.drift_ppm);
  const auto due = [&](std::int64_t sample) {
    return waveform.start() + Duration(std::llround(static_cast<double>(sample) * period_ns));
  };
  const auto elapsed = static_cast<double>((MonotonicClock::now() - waveform.start()).count());
  std::int64_t sample = std::max<std::int64_t>(0, static_cast<std::int64_t>(elapsed / period_ns));
  for (std::uint8_t count = 0;; ++count, sample += 2) {
    if (!wait_unless_interrupted(due(sample + 1) - MonotonicClock::now(), interrupt)) return {};
    const Duration since = due(sample) - waveform.start();
    const auto first = waveform.at(due(sample));
    const auto second = waveform.at(due(sample + 1));
    if (!first || !second) return {};
    const bool silent =
        faults.unplug_every > Duration(0) && since % (faults.unplug_every + faults.unplug_for) >= faults.unplug_every;
    if (silent || dice(random) < faults.lost) continue;
    const auto counts = [&](float mV) {
      return static_cast<std::int16_t>(std::lround(std::clamp(mV / settings.count_mV, -32768.0, 32767.0)));
    };
    CanEcgFrame ecg;
    ecg.count = count;
    ecg.lead_off = faults.missing(since);
    ecg.device_time_ms = static_cast<std::uint16_t>(since / std::chrono::milliseconds(1));
    ecg.values = {counts(*first), counts(*second)};
    if (auto sent = socket->send(encode_can_ecg(ecg, settings.identifier, settings.extended)); !sent) {
      return tl::unexpected(std::move(sent.error()));
    }
  }
}

}  // namespace perimap
