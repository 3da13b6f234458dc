#include "made_lead.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>

#include "core/statistics/nearest_pairs.hpp"

namespace perimap::test {
namespace {

double qt_s(const MadeLeadSettings& s) {
  return std::max(std::min(0.40 * std::sqrt(60.0 / s.per_minute), 0.46), s.qrs_s + 0.14);
}

bool fits(const MadeLeadSettings& s) {
  return s.pr_s + 0.5 * s.qrs_s + qt_s(s) + 0.03 < 60.0 / s.per_minute && s.pr_s > 0.5 * s.qrs_s + 0.06;
}

class Trace {
 public:
  Trace(double duration_s, double rate_hz) : rate_hz_(rate_hz), mV(static_cast<std::size_t>(duration_s * rate_hz)) {}

  void add_wave(double at_s, double height, double sigma_s) {
    const auto last = static_cast<long>(mV.size()) - 1;
    const long begin = std::max(0L, static_cast<long>((at_s - 5.0 * sigma_s) * rate_hz_));
    const long end = std::min(last, static_cast<long>((at_s + 5.0 * sigma_s) * rate_hz_));
    for (long i = begin; i <= end; ++i) {
      const double x = (static_cast<double>(i) / rate_hz_ - at_s) / sigma_s;
      mV[static_cast<std::size_t>(i)] += height * std::exp(-0.5 * x * x);
    }
  }
  // 3 mV for 2 ms, or as much in one sample.
  void add_spike(double at_s) {
    const auto begin = static_cast<long>(at_s * rate_hz_);
    const auto width = std::max(1L, static_cast<long>(0.002 * rate_hz_));
    for (long i = begin; i < begin + width; ++i) {
      if (i >= 0 && i < static_cast<long>(mV.size()))
        mV[static_cast<std::size_t>(i)] += 3.0 * std::min(1.0, 0.002 * rate_hz_);
    }
  }

 private:
  double rate_hz_;

 public:
  std::vector<double> mV;
};

}  // namespace

std::string MadeLeadSettings::text() const {
  std::ostringstream out;
  out << "P " << p << " T " << t << " PR " << pr_s << " QRS " << qrs_s << " P sigma " << p_sigma_s << " rate "
      << per_minute << " sign " << sign << " at " << rate_hz << " Hz, noise " << noise_mV << " jitter " << jitter
      << " block " << block << " spikes " << atrial_spikes << ventricular_spikes << " seed " << seed;
  return out.str();
}

MadeLead make_lead(const MadeLeadSettings& s) {
  std::mt19937_64 generator(s.seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  const double cycle_s = 60.0 / s.per_minute;
  const double sigma_s = s.qrs_s / 7.5;
  const double t_sigma_s = std::min(0.045, (qt_s(s) - 0.5 * s.qrs_s) * 0.19);
  Trace trace(s.duration_s, s.rate_hz);
  MadeLead lead;
  lead.rate_hz = s.rate_hz;
  int number = 0;
  for (double at_s = 0.45; at_s < s.duration_s - 0.4;
       at_s += cycle_s * (1.0 + s.jitter * normal(generator)), ++number) {
    trace.add_wave(at_s - s.pr_s, s.p, s.p_sigma_s);
    if (s.atrial_spikes) trace.add_spike(at_s - s.pr_s - 0.03);
    if (s.block && number % 2 == 1) continue;
    trace.add_wave(at_s, 1.0, sigma_s);
    trace.add_wave(at_s - 2.2 * sigma_s, -0.10, 0.9 * sigma_s);
    trace.add_wave(at_s + 2.6 * sigma_s, -0.25, sigma_s);
    trace.add_wave(at_s + qt_s(s) - 2.2 * t_sigma_s - 0.3 * s.qrs_s, s.t, t_sigma_s);
    if (s.ventricular_spikes) trace.add_spike(at_s - 0.04 - 0.3 * s.qrs_s);
    lead.beats_s.push_back(at_s);
  }
  for (std::size_t i = 0; i < trace.mV.size(); ++i) {
    const double wander = 0.05 * std::sin(2.0 * std::numbers::pi * 0.25 * static_cast<double>(i) / s.rate_hz);
    const double noise = s.noise_mV * normal(generator) + 0.01 * normal(generator);
    lead.mV.push_back(static_cast<float>(s.sign * trace.mV[i] + noise + wander));
  }
  return lead;
}

double MadeOutcome::f1_percent() const noexcept {
  const int found = beats - missed;
  return 200.0 * found / std::max(2 * found + missed + extra, 1);
}

bool MadeOutcome::confidently_wrong() const noexcept {
  constexpr double kMostWrong = 0.02;
  return wrong > std::max(1.0, kMostWrong * beats);
}

MadeOutcome scored(const MadeLead& lead, const std::vector<RPeak>& told) {
  constexpr double kMatch_s = 0.15;
  std::vector<double> told_s;
  for (const RPeak& peak : told) told_s.push_back(to_seconds(peak.time.time_since_epoch()));
  std::vector<bool> extra(told.size(), true);
  MadeOutcome outcome;
  outcome.beats = static_cast<int>(lead.beats_s.size());
  for (const int i : nearest_pairs(lead.beats_s, told_s, kMatch_s)) {
    if (i < 0) {
      ++outcome.missed;
    } else {
      extra[static_cast<std::size_t>(i)] = false;
    }
  }
  for (std::size_t i = 0; i < told.size(); ++i) {
    const bool doubted = told[i].confidence <= MadeOutcome::kWrong;
    outcome.extra += extra[i] ? 1 : 0;
    outcome.wrong += extra[i] && !doubted ? 1 : 0;
    outcome.doubted += doubted ? 1 : 0;
  }
  return outcome;
}

MadeLeadSettings draw_lead(std::mt19937_64& generator) {
  const auto uniform = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(generator);
  };
  const auto evenly_in_log = [&](double from, double to) { return std::exp(uniform(std::log(from), std::log(to))); };
  constexpr std::array<double, 7> kRates{100.0, 125.0, 200.0, 250.0, 360.0, 500.0, 1000.0};
  MadeLeadSettings s;
  do {
    s.p = uniform(0.1, 1.0);
    s.t = evenly_in_log(0.2, 2.0);
    s.pr_s = uniform(0.1, 0.26);
    s.qrs_s = uniform(0.06, 0.18);
    s.p_sigma_s = uniform(0.017, 0.026);
    s.block = uniform(0.0, 1.0) < 0.12;
    s.per_minute = evenly_in_log(s.block ? 56.0 : 28.0, 240.0);
    s.sign = uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0;
    s.rate_hz = kRates[std::uniform_int_distribution<std::size_t>(0, kRates.size() - 1)(generator)];
    s.noise_mV = uniform(0.0, 1.0) < 0.4 ? 0.0 : uniform(0.0, 0.2);
    s.atrial_spikes = uniform(0.0, 1.0) < 0.12;
    s.ventricular_spikes = uniform(0.0, 1.0) < 0.12;
    s.jitter = uniform(0.005, 0.05);
    s.seed = generator();
  } while (!fits(s));
  return s;
}

bool is_plain(const MadeLeadSettings& s) noexcept { return s.p < 1.2 && s.t < 1.2 && s.qrs_s < 4.5 * s.p_sigma_s; }

}  // namespace perimap::test
