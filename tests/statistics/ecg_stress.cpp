// The ECG side on real records with disturbances added, and the rhythm monitor on rhythms that are drawn: the tables of
// docs/evidence/ecg.md.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/phase/rhythm_monitor.hpp"
#include "daemon/evaluation/ecg/beat_score.hpp"
#include "daemon/evaluation/ecg/ecg_analysis.hpp"
#include "drivers/ecg_file/beat_table.hpp"
#include "drivers/ecg_file/ecg_trace.hpp"
#include "drivers/standins/simulator/ecg_record.hpp"
#include "drivers/standins/simulator/embedded_data.hpp"
#include "goals.hpp"

namespace perimap::test {
namespace {

using Generator = std::mt19937_64;

constexpr double kTau = 2.0 * std::numbers::pi;
constexpr double kExcerpt_s = 300.0;  // of each record, in the short form
// Its QRS is 0.4 mV high; the disturbances are sized for 1 mV.
constexpr std::string_view kSmallLead = "03700181";

// One record's lead and beats, evenly sampled from time 0.
struct Lead {
  double rate_hz = 0.0;
  std::vector<float> mV;
  std::vector<ReferenceBeat> beats;

  [[nodiscard]] double duration_s() const { return static_cast<double>(mV.size()) / rate_hz; }
  [[nodiscard]] double time_s(std::size_t i) const { return static_cast<double>(i) / rate_hz; }
};

Lead load(const EmbeddedEcgRecord& embedded, bool whole) {
  const auto record = load_ecg_record(embedded.name);
  if (!record) throw std::runtime_error(record.error().message);
  const auto beats = parse_beat_table(embedded.beats_csv, std::string(embedded.name));
  if (!beats) throw std::runtime_error(beats.error().message);
  Lead lead;
  lead.rate_hz = record->sample_rate_hz;
  for (std::size_t i = 0; i < record->samples.size(); ++i) {
    if (!whole && lead.duration_s() >= kExcerpt_s) break;
    lead.mV.push_back(record->mV(i));
  }
  for (const ReferenceBeat& beat : beats->beats) {
    if (beat.time_s < lead.duration_s()) lead.beats.push_back(beat);
  }
  return lead;
}

// ---- disturbances

// Each sample through `change(t_s, mV)`.
template <class Change>
Lead changed(Lead lead, Change&& change) {
  for (std::size_t i = 0; i < lead.mV.size(); ++i) {
    lead.mV[i] = static_cast<float>(change(lead.time_s(i), static_cast<double>(lead.mV[i])));
  }
  return lead;
}

// Downward by averaging over the new period, upward by cubic (Catmull-Rom) interpolation.
Lead resampled(const Lead& lead, double rate_hz) {
  Lead result = lead;
  result.rate_hz = rate_hz;
  result.mV.clear();
  const double ratio = lead.rate_hz / rate_hz;
  const auto last = static_cast<long>(lead.mV.size()) - 1;
  const auto at = [&](long i) {
    return static_cast<double>(lead.mV[static_cast<std::size_t>(std::clamp(i, 0L, last))]);
  };
  for (std::size_t i = 0; i < static_cast<std::size_t>(lead.duration_s() * rate_hz); ++i) {
    const double x = static_cast<double>(i) * ratio;
    double value = 0.0;
    if (ratio > 1.0) {
      const long from = std::max(static_cast<long>(std::ceil(x - 0.5 * ratio)), 0L);
      const long to = std::min(static_cast<long>(std::floor(x + 0.5 * ratio)), last);
      for (long k = from; k <= to; ++k) value += at(k) / static_cast<double>(to - from + 1);
    } else {
      const long k = static_cast<long>(x);
      const double u = x - static_cast<double>(k);
      const double p0 = at(k - 1);
      const double p1 = at(k);
      const double p2 = at(k + 1);
      const double p3 = at(k + 2);
      value = p1 + 0.5 * u * (p2 - p0 + u * (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3 + u * (3.0 * (p1 - p2) + p3 - p0)));
    }
    result.mV.push_back(static_cast<float>(value));
  }
  return result;
}

Lead twice_as_fast(const Lead& lead) {
  Lead result = resampled(lead, 0.5 * lead.rate_hz);
  result.rate_hz = lead.rate_hz;
  for (ReferenceBeat& beat : result.beats) beat.time_s *= 0.5;
  return result;
}

// A spike of one sample and its decay, so long before each beat.
Lead paced(Lead lead, double height_mV, double before_s) {
  for (const ReferenceBeat& beat : lead.beats) {
    const long i = std::lround((beat.time_s - before_s) * lead.rate_hz);
    if (i <= 0 || i + 1 >= static_cast<long>(lead.mV.size())) continue;
    lead.mV[static_cast<std::size_t>(i)] += static_cast<float>(height_mV);
    lead.mV[static_cast<std::size_t>(i + 1)] += static_cast<float>(0.3 * height_mV);
  }
  return lead;
}

// A spike of 2 ms, of which a converter so slow takes the mean over one sample.
Lead paced_at(const Lead& whole, double rate_hz, double height_mV, double before_s) {
  Lead lead = resampled(whole, rate_hz);
  for (const ReferenceBeat& beat : lead.beats) {
    const auto i = static_cast<long>((beat.time_s - before_s) * lead.rate_hz);
    if (i < 0 || i >= static_cast<long>(lead.mV.size())) continue;
    lead.mV[static_cast<std::size_t>(i)] += static_cast<float>(height_mV * 0.002 * rate_hz);
  }
  return lead;
}

// The first samples of each period are none.
Lead with_missing(const Lead& lead, double every_s, double for_s) {
  return changed(lead, [&](double t, double mV) {
    return std::fmod(t, every_s) < for_s ? std::numeric_limits<double>::quiet_NaN() : mV;
  });
}

// A bump of 45 ms standard deviation where the T wave is: 0.3 s / sqrt(s) after the R peak, as Bazett has it.
Lead tall_t_waves(Lead lead, double height_mV) {
  constexpr double kWidth_s = 0.045;
  for (std::size_t b = 0; b < lead.beats.size(); ++b) {
    const double cycle_s = b + 1 < lead.beats.size() ? lead.beats[b + 1].time_s - lead.beats[b].time_s : 0.8;
    const double centre_s = lead.beats[b].time_s + 0.3 * std::sqrt(std::min(cycle_s, 1.2));
    const long reach = std::lround(0.2 * lead.rate_hz);
    const long centre = std::lround(centre_s * lead.rate_hz);
    for (long i = std::max(centre - reach, 0L); i <= std::min(centre + reach, static_cast<long>(lead.mV.size()) - 1);
         ++i) {
      const double off = (static_cast<double>(i) / lead.rate_hz - centre_s) / kWidth_s;
      lead.mV[static_cast<std::size_t>(i)] += static_cast<float>(height_mV * std::exp(-0.5 * off * off));
    }
  }
  return lead;
}

// The last 5 s of each minute become `instead()`; the beats in them cannot be found.
template <class Instead>
Lead with_drop_outs(const Lead& lead, Instead&& instead) {
  constexpr double kFrom_s = 55.0;
  Lead result = changed(lead, [&](double t, double mV) { return std::fmod(t, 60.0) > kFrom_s ? instead() : mV; });
  std::erase_if(result.beats, [](const ReferenceBeat& beat) {
    const double t = std::fmod(beat.time_s, 60.0);
    return t >= kFrom_s - 0.05 || (beat.time_s > 60.0 && t <= 0.1);  // cut by the edges as well
  });
  return result;
}

struct Disturbance {
  std::string name;
  double least_percent;  // F1 that the worst record had, less a margin: a guard against getting worse
  std::function<Lead(const Lead&, Generator&)> apply;
};

// The amplitude times `factor` in the second sixth of the record: 5 of 30 minutes.
Lead with_amplitude(const Lead& lead, double factor) {
  const double sixth_s = lead.duration_s() / 6.0;
  return changed(lead, [&](double t, double mV) { return t > sixth_s && t < 2.0 * sixth_s ? factor * mV : mV; });
}

Lead with_white_noise(const Lead& lead, double rms_mV, Generator& generator) {
  std::normal_distribution<double> noise(0.0, rms_mV);
  return changed(lead, [&](double, double mV) { return mV + noise(generator); });
}

// Noise for the first `length_s` of every 20 s, and an amplifier that saturates.
Lead with_bursts(const Lead& lead, double rms_mV, double length_s, double rail_mV, Generator& generator) {
  std::normal_distribution<double> noise(0.0, rms_mV);
  return changed(lead, [&](double t, double mV) {
    return std::clamp(std::fmod(t, 20.0) < length_s ? mV + noise(generator) : mV, -rail_mV, rail_mV);
  });
}

Lead with_steps(const Lead& lead, Generator& generator) {
  std::normal_distribution<double> height(0.0, 2.0);
  double level = 0.0;
  long interval = -1;
  return changed(lead, [&](double t, double mV) {
    if (static_cast<long>(t / 7.0) != interval) {
      interval = static_cast<long>(t / 7.0);
      level = height(generator);
    }
    return mV + level;
  });
}

// White noise through two low passes at 3.5 Hz and a high pass at 0.6 Hz.
Lead with_motion(const Lead& lead, Generator& generator) {
  std::normal_distribution<double> noise(0.0, 1.0);
  double first = 0.0;
  double second = 0.0;
  double drift = 0.0;
  return changed(lead, [&](double, double mV) {
    first += 0.06 * (noise(generator) - first);
    second += 0.06 * (first - second);
    drift += 0.01 * (second - drift);
    return mV + 4.0 * (second - drift);
  });
}

Lead with_sine(const Lead& lead, double amplitude_mV, double frequency_hz) {
  return changed(lead, [&](double t, double mV) { return mV + amplitude_mV * std::sin(kTau * frequency_hz * t); });
}

std::vector<Disturbance> disturbances() {
  std::vector<Disturbance> all;
  const auto add = [&](std::string name, double least_percent, auto apply) {
    all.push_back({std::move(name), least_percent, std::move(apply)});
  };
  add("none", 99.4, [](const Lead& lead, Generator&) { return lead; });
  for (const double gain : {0.01, 100.0, -1.0}) {
    add(fmt::format("gain {:g}", gain), 99.4, [gain](const Lead& lead, Generator&) {
      return changed(lead, [gain](double, double mV) { return gain * mV; });
    });
  }
  for (const double rate_hz : {100.0, 128.0, 200.0, 250.0, 500.0, 1000.0}) {
    add(fmt::format("{:g} Hz", rate_hz), 99.0,
        [rate_hz](const Lead& lead, Generator&) { return resampled(lead, rate_hz); });
  }
  add("everything twice as fast", 99.0, [](const Lead& lead, Generator&) { return twice_as_fast(lead); });
  add("wander 2 mV at 0.3 Hz, 1 mV at 0.71 Hz", 98.5,
      [](const Lead& lead, Generator&) { return with_sine(with_sine(lead, 2.0, 0.3), 1.0, 0.71); });
  add("steps of 2 mV RMS every 7 s", 96.0, with_steps);
  for (const double frequency_hz : {50.3, 60.2}) {
    add(fmt::format("mains 0.5 mV at {:g} Hz", frequency_hz), 98.8,
        [frequency_hz](const Lead& lead, Generator&) { return with_sine(lead, 0.5, frequency_hz); });
  }
  for (const double rms_mV : {0.1, 0.2}) {
    add(fmt::format("white noise {:g} mV RMS", rms_mV), 98.8,
        [rms_mV](const Lead& lead, Generator& generator) { return with_white_noise(lead, rms_mV, generator); });
  }
  add("pacing spikes 2 mV, 60 ms before", 99.0, [](const Lead& lead, Generator&) { return paced(lead, 2.0, 0.06); });
  add("pacing spikes -5 mV, 60 ms before", 99.0, [](const Lead& lead, Generator&) { return paced(lead, -5.0, 0.06); });
  add("pacing spikes 4 mV, 160 ms before", 99.0, [](const Lead& lead, Generator&) { return paced(lead, 4.0, 0.16); });
  for (const double rate_hz : {100.0, 200.0}) {
    add(fmt::format("pacing spikes 5 mV, 160 ms before, {:g} Hz", rate_hz), 99.0,
        [rate_hz](const Lead& lead, Generator&) { return paced_at(lead, rate_hz, 5.0, 0.16); });
  }
  add("no samples for 15 ms of each 0.7 s", 99.0,
      [](const Lead& lead, Generator&) { return with_missing(lead, 0.7, 0.015); });
  add("no samples for 25 ms of each 0.7 s", 98.0,
      [](const Lead& lead, Generator&) { return with_missing(lead, 0.7, 0.025); });
  add("T waves 1.2 mV higher", 93.0, [](const Lead& lead, Generator&) { return tall_t_waves(lead, 1.2); });
  add("amplitude / 10 for a sixth of the time", 96.0,
      [](const Lead& lead, Generator&) { return with_amplitude(lead, 0.1); });
  add("amplitude x 10 for a sixth of the time", 96.0,
      [](const Lead& lead, Generator&) { return with_amplitude(lead, 10.0); });
  add("amplitude 1 to 10 and back each minute", 97.0, [](const Lead& lead, Generator&) {
    return changed(lead,
                   [](double t, double mV) { return mV * std::pow(10.0, 0.5 + 0.5 * std::sin(kTau * t / 60.0)); });
  });
  add("amplifier saturates at 0.5 mV", 94.0, [](const Lead& lead, Generator&) {
    return changed(lead, [](double, double mV) { return std::clamp(mV, -0.5, 0.5); });
  });
  add("drop-outs to the rail, 5 s a minute", 98.5,
      [](const Lead& lead, Generator&) { return with_drop_outs(lead, [] { return 5.12; }); });
  add("drop-outs to noise of 30 uV, 5 s a minute", 97.5, [](const Lead& lead, Generator& generator) {
    std::normal_distribution<double> noise(0.0, 0.03);
    return with_drop_outs(lead, [&] { return noise(generator); });
  });
  add("motion 1 to 5 Hz as large as the beats", 90.0, with_motion);
  add("electrosurgery 2 mV, 2 s of 20 s", 90.0,
      [](const Lead& lead, Generator& generator) { return with_bursts(lead, 2.0, 2.0, 10.0, generator); });
  add("electrosurgery 10 mV, 3 s of 20 s, rail at 5 mV", 85.0,
      [](const Lead& lead, Generator& generator) { return with_bursts(lead, 10.0, 3.0, 5.0, generator); });
  return all;
}

EcgAnalysis analysed(const Lead& lead, EcgTrace& trace) {
  trace.mV = lead.mV;
  trace.time_s.resize(lead.mV.size());
  for (std::size_t i = 0; i < lead.mV.size(); ++i) trace.time_s[i] = lead.time_s(i);
  return analyse(trace, [](std::size_t) { return true; });
}

// ---- rhythms

// Interval i of a rhythm, in seconds; the memory is what the rhythm keeps between intervals, zero at the start.
using Interval = std::function<double(int i, std::array<double, 2>& memory, Generator& generator)>;

double normal(double deviation, Generator& generator) {
  return std::normal_distribution<double>(0.0, deviation)(generator);
}

// Percentage of the time, once 30 intervals are known, that the rhythm is called unpredictable.
double unpredictable_percent(const Interval& interval, std::uint64_t seed, int trials) {
  int called = 0;
  int all = 0;
  for (int trial = 0; trial < trials; ++trial) {
    Generator generator(1000 * seed + static_cast<std::uint64_t>(trial));
    std::array<double, 2> memory{};
    RhythmMonitor monitor;
    for (int i = 0; i < 300; ++i) {
      monitor.push(Seconds(interval(i, memory, generator)));
      if (i <= RhythmMonitor::kWindow) continue;
      ++all;
      called += monitor.rhythm() == Rhythm::kUnpredictable ? 1 : 0;
    }
  }
  return 100.0 * called / all;
}

Interval fibrillation(double mean_s, double variation) {
  return [=](int, std::array<double, 2>&, Generator& generator) {
    std::gamma_distribution<double> gamma(1.0 / (variation * variation), mean_s * variation * variation);
    return std::max(0.25, gamma(generator));  // the refractory time of the node
  };
}

// Breathing with a period in cycles that varies by some per cent, a slow wander, and jitter.
Interval breathing(double depth, double period) {
  return [=](int, std::array<double, 2>& memory, Generator& generator) {
    double& phase = memory[0];
    double& wander_s = memory[1];
    phase += kTau / period * (1.0 + normal(0.08, generator));
    wander_s = 0.95 * wander_s + normal(0.01, generator);
    return 0.9 * (1.0 + depth * std::sin(phase)) + wander_s + normal(0.012, generator);
  };
}

// Intervals that repeat, with jitter.
Interval repeating(std::vector<double> cycle_s, double deviation_s) {
  return [=](int i, std::array<double, 2>&, Generator& generator) {
    return cycle_s[static_cast<std::size_t>(i) % cycle_s.size()] + normal(deviation_s, generator);
  };
}

// A premature beat and its pause, at random, in a rhythm of 0.8 s.
Interval premature(double share) {
  return [=](int, std::array<double, 2>& memory, Generator& generator) {
    double rr_s = 0.8;
    if (memory[0] > 0.0) {
      rr_s = 1.1;
      memory[0] = 0.0;
    } else if (std::uniform_real_distribution<double>(0.0, 1.0)(generator) < share) {
      rr_s = 0.5 + normal(0.03, generator);
      memory[0] = 1.0;
    }
    return rr_s + normal(0.02, generator);
  };
}

void rhythm_table(const Extent& extent, GoalReport& report) {
  constexpr double kLeastCalled = 95.0;
  constexpr double kMostCalled = 6.0;
  const int trials = extent.whole ? 40 : 6;
  const auto called = [&](const Interval& interval) { return unpredictable_percent(interval, extent.seed, trials); };
  report.heading("called unpredictable, % of the time", {"0.45 s", "0.6 s", "0.8 s", "1 s"});
  for (const double variation : {0.12, 0.16, 0.20, 0.24, 0.30}) {
    std::vector<double> row;
    for (const double mean_s : {0.45, 0.6, 0.8, 1.0}) row.push_back(called(fibrillation(mean_s, variation)));
    report.row(fmt::format("gamma intervals, variation {:g} %, by mean", 100.0 * variation), row, kLeastCalled, 100.0);
  }
  report.heading("", {"3.3", "4.7", "6.1"});
  for (const double depth : {0.05, 0.10, 0.15, 0.20, 0.25}) {
    std::vector<double> row;
    for (const double period : {3.3, 4.7, 6.1}) row.push_back(called(breathing(depth, period)));
    report.row(fmt::format("breathing by {:g} %, by its period in cycles", 100.0 * depth), row, 0.0, kMostCalled);
  }
  report.heading("", {});
  report.row("regular, 0.8 s, deviation 2 %", {called(repeating({0.8}, 0.016))}, 0.0, kMostCalled);
  report.row("bigeminy, deviation 20 ms", {called(repeating({1.05, 0.55}, 0.020))}, 0.0, kMostCalled);
  report.row("bigeminy, deviation 30 ms", {called(repeating({1.05, 0.55}, 0.030))}, 0.0, kMostCalled);
  report.row("trigeminy, deviation 20 ms", {called(repeating({0.8, 0.5, 1.1}, 0.020))}, 0.0, kMostCalled);
  // What the monitor is spared: intervals of ventricular beats are not given to it.
  report.row("premature beats at random, 15 %, not left out", {called(premature(0.15))}, 0.0, 100.0);
  report.row("premature beats at random, 30 %, not left out", {called(premature(0.30))}, 0.0, 100.0);
}

}  // namespace

void beats_under_disturbances(const Extent& extent, const HeartMesh&, GoalReport& report) {
  std::vector<Lead> leads;
  std::vector<std::string> names;
  for (const EmbeddedEcgRecord& embedded : embedded_ecg_records()) {
    if (embedded.name == kSmallLead) continue;
    leads.push_back(load(embedded, extent.whole));
    names.emplace_back(embedded.name);
  }
  report.heading("disturbance: F1 of the beats, %", names);
  std::vector<double> unpredictable;
  for (const Disturbance& disturbance : disturbances()) {
    std::vector<double> row;
    for (const Lead& lead : leads) {
      Generator generator(extent.seed);
      const Lead disturbed = disturbance.apply(lead, generator);
      EcgTrace trace;
      const EcgAnalysis analysis = analysed(disturbed, trace);
      row.push_back(score_beats(disturbed.beats, analysis, trace).f1_percent.value());
      if (unpredictable.size() < leads.size()) {
        unpredictable.push_back(100.0 * analysis.unpredictable_s / analysis.duration_s);
      }
    }
    report.row(disturbance.name, row, disturbance.least_percent, 100.0);
  }
  rhythm_table(extent, report);
  report.heading("", names);
  report.row("the records, undisturbed", unpredictable, 0.0, 100.0);
}

}  // namespace perimap::test
