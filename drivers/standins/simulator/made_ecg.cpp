#include "drivers/standins/simulator/made_ecg.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/angle/angle.hpp"
#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {
namespace {

constexpr std::uint64_t kMadeEcgStream = 0x6d616465;
constexpr double kMadeRate_hz = 500.0;
constexpr double kCounts_per_mV = 1000.0;
constexpr double kReach_s = 0.8;  // of a beat's waves

struct Wave {
  double at_s, width_s, mV;
};
constexpr std::array<Wave, 4> kFixed{
    {{-0.17, 0.022, 0.12}, {-0.028, 0.009, -0.12}, {0.0, 0.011, 1.2}, {0.030, 0.010, -0.25}}};
constexpr Wave kT{0.30, 0.045, 0.28};  // after a cycle of a second: the faster the earlier (Bazett)

double bell(const Wave& wave, double t_s) {
  const double off = (t_s - wave.at_s) / wave.width_s;
  return wave.mV * std::exp(-0.5 * off * off);
}

}  // namespace

EcgRecord made_ecg(const std::vector<double>& beats_s, std::uint64_t seed) {
  const CounterNoise noise(seed, kMadeEcgStream);
  const auto count = static_cast<std::size_t>((beats_s.back() + 1.0) * kMadeRate_hz);
  std::vector<double> mV(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double t_s = static_cast<double>(i) / kMadeRate_hz;
    mV[i] = 0.015 * noise.normal(i) + 0.05 * std::sin(kTwoPi * 0.11 * t_s) + 0.03 * std::sin(kTwoPi * 0.29 * t_s + 1.0);
  }
  EcgRecord record{"made", kMadeRate_hz, kCounts_per_mV, {}, {}};
  for (std::size_t beat = 0; beat < beats_s.size(); ++beat) {
    const double r_s = beats_s[beat];
    record.beat_samples.push_back(static_cast<std::uint32_t>(std::lround(r_s * kMadeRate_hz)));
    const double cycle_s = beat > 0 ? r_s - beats_s[beat - 1] : beats_s[1] - beats_s[0];
    Wave T = kT;
    T.at_s *= std::sqrt(cycle_s);
    const auto from = static_cast<std::size_t>(std::max(0.0, (r_s - kReach_s) * kMadeRate_hz));
    const auto to = std::min(count, static_cast<std::size_t>((r_s + kReach_s) * kMadeRate_hz));
    for (std::size_t i = from; i < to; ++i) {
      const double t_s = static_cast<double>(i) / kMadeRate_hz - r_s;
      mV[i] += bell(T, t_s);
      for (const Wave& wave : kFixed) mV[i] += bell(wave, t_s);
    }
  }
  for (const double value : mV)
    record.samples.push_back(static_cast<std::int16_t>(std::lround(value * kCounts_per_mV)));
  return record;
}

}  // namespace perimap
