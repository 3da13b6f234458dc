#include "drivers/standins/emulator/can_ecg_emulator.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "drivers/transport/can_socket.hpp"

namespace perimap {

Expected<void> emulate_can_ecg(const std::string& interface_name, const EcgDeviceSignals& signals,
                               const CanEcgSettings& settings, const EmulatorFaults& faults,
                               const Interrupt& interrupt) {
  // Listens to no identifier of use: this end only sends.
  auto socket = CanSocket::open(interface_name, settings.identifier, settings.extended);
  if (!socket) return tl::unexpected(std::move(socket.error()));
  std::mt19937_64 random(faults.seed);
  std::uniform_real_distribution<> dice(0.0, 1.0);
  const double period_ns = 1e9 / settings.sample_rate_hz / (1.0 + 1e-6 * faults.drift_ppm);
  const Instant start = signals.ecg_mV.start();
  const auto due = [&](std::int64_t sample) {
    return start + Duration(std::llround(static_cast<double>(sample) * period_ns));
  };
  const auto elapsed = static_cast<double>((MonotonicClock::now() - start).count());
  std::int64_t sample = std::max<std::int64_t>(0, static_cast<std::int64_t>(elapsed / period_ns));
  const bool breathes = signals.respiration.has_value();
  const int samples = breathes ? 1 : 2;
  for (std::uint8_t count = 0;; ++count, sample += samples) {
    const Instant newest = due(sample + samples - 1);
    if (!wait_unless_interrupted(newest - MonotonicClock::now(), interrupt)) return {};
    const Duration since = due(sample) - start;
    const auto first = signals.ecg_mV.at(due(sample));
    const auto last = signals.ecg_mV.at(newest);
    if (!first || !last) return {};
    const bool silent =
        faults.unplug_every > Duration(0) && since % (faults.unplug_every + faults.unplug_for) >= faults.unplug_every;
    if (silent || dice(random) < faults.lost) continue;
    const auto counts = [](double value) {
      return static_cast<std::int16_t>(std::isnan(value) ? 0 : std::lround(std::clamp(value, -32768.0, 32767.0)));
    };
    CanEcgFrame ecg;
    ecg.count = count;
    ecg.samples = samples;
    ecg.lead_off = faults.missing(since) || std::isnan(*first) || std::isnan(*last);
    ecg.device_time_ms = static_cast<std::uint16_t>(since / std::chrono::milliseconds(1));
    ecg.values = {counts(*first / settings.count_mV), counts(*last / settings.count_mV)};
    if (breathes) {
      const float respiration = signals.respiration_at(due(sample));
      ecg.respiration = true;
      ecg.respiration_off = std::isnan(respiration);
      ecg.values[1] = counts(10000.0 * respiration);
    }
    if (auto sent = socket->send(encode_can_ecg(ecg, settings.identifier, settings.extended)); !sent) {
      return tl::unexpected(std::move(sent.error()));
    }
  }
}

}  // namespace perimap
