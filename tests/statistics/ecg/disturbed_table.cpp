// Bursts of electrosurgery and leads that come off, put into records.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "core/phase/r_peak_detector.hpp"
#include "lead_disturbances.hpp"
#include "tables.hpp"

namespace perimap::test {
namespace {

constexpr double kLength_s = 200.0;
constexpr double kFirst_s = 25.0;
constexpr double kMatch_s = 0.15;
constexpr double kBelieved = 0.5;

struct Outcome {
  int stretches = 0;
  int bad = 0;
  int late = 0;
  int late_only_so = 0;  // of these, without the burst the beat is found
  int unsaid = 0;
  int outside = 0;
  int missed = 0;
  int extra = 0;
  int missed_without = 0;  // with nothing put in
  int extra_without = 0;

  static double f1(int beats, int missed, int extra) {
    const int found = beats - missed;
    return 200.0 * found / std::max(2 * found + missed + extra, 1);
  }
};

struct Heard {
  std::vector<RPeak> peaks;
  std::vector<bool> called_good;
};

double time_of(const RPeak& peak) { return to_seconds(peak.time.time_since_epoch()); }

Heard heard_in(const MadeLead& lead) {
  const auto detector = std::make_unique<RPeakDetector>();
  Heard heard;
  for (std::size_t i = 0; i < lead.mV.size(); ++i) {
    const Instant t(from_seconds(static_cast<double>(i) / lead.rate_hz));
    if (const auto peak = detector->push(t, lead.mV[i])) heard.peaks.push_back(*peak);
    heard.called_good.push_back(detector->signal() == EcgSignal::kGood);
  }
  while (const auto peak = detector->flush()) heard.peaks.push_back(*peak);
  return heard;
}

bool found(const std::vector<RPeak>& peaks, double beat_s) {
  return std::any_of(peaks.begin(), peaks.end(),
                     [&](const RPeak& p) { return std::abs(time_of(p) - beat_s) < kMatch_s; });
}

bool real(const RPeak& peak, const std::vector<double>& beats_s) {
  const auto next = std::lower_bound(beats_s.begin(), beats_s.end(), time_of(peak) - kMatch_s);
  return next != beats_s.end() && *next < time_of(peak) + kMatch_s;
}

struct Stretch {
  double begin_s = 0.0;
  double end_s = 0.0;
};

// `off`: the lead is off, so that no beat at all is to be believed.
void judge(const RecordedLead& record, const DisturbedStretches& kind, bool off, std::mt19937_64& generator,
           std::string& late_ones, Outcome& outcome) {
  const auto uniform = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(generator);
  };
  const RecordedLead part = stretch_of(record, uniform(0.0, record.trace.time_s.back() - kLength_s), kLength_s);
  MadeLead lead;
  lead.rate_hz = part.rate_hz;
  lead.mV = part.trace.mV;
  for (const ReferenceBeat& beat : part.beats) lead.beats_s.push_back(beat.time_s);
  const Heard undisturbed = heard_in(lead);
  std::vector<Stretch> stretches;
  for (double at_s = kFirst_s;;) {
    const double length_s = std::exp(uniform(std::log(kind.shortest_s), std::log(kind.longest_s)));
    if (at_s + length_s + 8.0 > kLength_s) break;
    stretches.push_back({at_s, at_s + length_s});
    const auto sample = [&](double t) { return static_cast<std::size_t>(t * lead.rate_hz); };
    kind.disturb(lead, sample(at_s), sample(at_s + length_s), generator);
    at_s += length_s + uniform(10.0, 18.0);
  }
  const Heard heard = heard_in(lead);
  const auto inside = [&](double t) {
    return std::any_of(stretches.begin(), stretches.end(),
                       [&](const Stretch& s) { return t > s.begin_s - 0.1 && t < s.end_s + 0.3; });
  };
  for (const Stretch& stretch : stretches) {
    ++outcome.stretches;
    outcome.unsaid += heard.called_good[static_cast<std::size_t>((stretch.begin_s + 1.0) * lead.rate_hz)] ? 1 : 0;
    outcome.bad += std::any_of(heard.peaks.begin(), heard.peaks.end(), [&](const RPeak& peak) {
      const double t = time_of(peak);
      return t > stretch.begin_s && t < stretch.end_s && peak.confidence > kBelieved &&
             (off ? t > stretch.begin_s + 0.1 && t < stretch.end_s - 0.1 : !real(peak, lead.beats_s));
    });
    auto beat = std::lower_bound(lead.beats_s.begin(), lead.beats_s.end(), stretch.end_s + 0.2);
    bool late = false;
    bool only_so = false;
    for (int n = 0; n < 6 && beat != lead.beats_s.end(); ++n, ++beat) {
      if (n < 3 || found(heard.peaks, *beat)) continue;
      late = true;
      only_so = only_so || found(undisturbed.peaks, *beat);
    }
    outcome.late += late ? 1 : 0;
    outcome.late_only_so += only_so ? 1 : 0;
    if (late) late_ones += " " + record.name;
  }
  for (const double beat_s : lead.beats_s) {
    if (inside(beat_s)) continue;
    ++outcome.outside;
    outcome.missed += found(heard.peaks, beat_s) ? 0 : 1;
    outcome.missed_without += found(undisturbed.peaks, beat_s) ? 0 : 1;
  }
  for (const RPeak& peak : heard.peaks) outcome.extra += !inside(time_of(peak)) && !real(peak, lead.beats_s) ? 1 : 0;
  for (const RPeak& peak : undisturbed.peaks) {
    outcome.extra_without += !inside(time_of(peak)) && !real(peak, lead.beats_s) ? 1 : 0;
  }
}

void print_row(const std::string& name, const Outcome& o, const std::string& late_ones) {
  fmt::print("| {} | {} | {} | {} | {} | {} | {:.2f} | {:.2f} | {} |\n", name, o.stretches, o.bad, o.late,
             o.late_only_so, o.unsaid, Outcome::f1(o.outside, o.missed, o.extra),
             Outcome::f1(o.outside, o.missed_without, o.extra_without), late_ones);
}

}  // namespace

void print_disturbed(const std::vector<RecordedLead>& records, std::uint64_t seed) {
  for (const bool aside : {false, true}) {
    const std::vector<RecordedLead> part = part_of(records, aside, false);
    if (part.empty()) continue;
    fmt::print(
        "| {} | stretches | bad | late | of these not without it | called good after 1 s | F1 outside, % | the same "
        "beats without, % | late "
        "in records |\n|---|---|---|---|---|---|---|---|---|\n",
        aside ? "aside" : "development");
    std::mt19937_64 generator(seed);
    const auto run = [&](const DisturbedStretches& kind, bool off, int times) {
      Outcome outcome;
      std::string late_ones;
      for (int again = 0; again < times; ++again) {
        for (const RecordedLead& record : part) judge(record, kind, off, generator, late_ones, outcome);
      }
      print_row((off ? "off: " : "") + kind.name, outcome, late_ones);
    };
    for (const DisturbedStretches& kind : electrosurgery()) run(kind, false, 2);
    for (const DisturbedStretches& kind : leads_off()) run(kind, true, 1);
    fmt::print("\n");
  }
}

}  // namespace perimap::test
