// Records with a second lead that is made of the first: by either alone and by both.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <string>

#include "daemon/evaluation/ecg/beat_score.hpp"
#include "lead_disturbances.hpp"
#include "tables.hpp"

namespace perimap::test {
namespace {

constexpr double kLength_s = 120.0;
constexpr double kFirst_s = 25.0;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

using Trace = std::vector<float>;

// The record turned over, at 0.6 of its size, with half of its change over 10 ms and noise of its own.
Trace second_of(const RecordedLead& record, std::mt19937_64& generator) {
  std::normal_distribution<float> noise(0.0F, 0.03F);
  const auto back = static_cast<std::size_t>(0.01 * record.rate_hz);
  Trace second(record.trace.mV.size());
  for (std::size_t i = 0; i < second.size(); ++i) {
    const float value = record.trace.mV[i];
    second[i] = -0.6F * value + 0.5F * (value - record.trace.mV[i > back ? i - back : 0]) + noise(generator);
  }
  return second;
}

struct Condition {
  std::string name;
  Disturb first;  // none: left as it is
  Disturb second;
  double shortest_s = 0.0;  // 0: all of the time
  double longest_s = 0.0;
  bool together = false;  // the same in both leads
};

void no_samples(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64&) {
  std::fill(lead.mV.begin() + static_cast<std::ptrdiff_t>(begin), lead.mV.begin() + static_cast<std::ptrdiff_t>(end),
            kNone);
}

void white_noise(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator) {
  std::normal_distribution<float> noise(0.0F, 0.2F);
  for (std::size_t i = begin; i < end; ++i) lead.mV[i] += noise(generator);
}

// White noise through two low passes at 3.5 Hz and a high pass at 0.6 Hz.
void motion(MadeLead& lead, std::size_t begin, std::size_t end, std::mt19937_64& generator) {
  std::normal_distribution<double> noise(0.0, 1.0);
  double low = 0.0;
  double lower = 0.0;
  double drift = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    low += 0.06 * (noise(generator) - low);
    lower += 0.06 * (low - lower);
    drift += 0.01 * (lower - drift);
    lead.mV[i] += static_cast<float>(4.0 * (lower - drift));
  }
}

std::vector<Condition> conditions() {
  std::vector<Condition> all{
      {"none", {}, {}}, {"first: no samples", no_samples, {}}, {"second: no samples", {}, no_samples}};
  for (const bool second : {false, true}) {
    const auto add = [&](const DisturbedStretches& kind, const std::string& what) {
      const Disturb none;
      all.push_back({(second ? "second" : "first") + what + kind.name, second ? none : kind.disturb,
                     second ? kind.disturb : none, kind.shortest_s, kind.longest_s});
    };
    for (const DisturbedStretches& kind : electrosurgery()) add(kind, ": ");
    for (const DisturbedStretches& kind : leads_off()) add(kind, " off: ");
    add({"white noise 0.2 mV", white_noise, 0.0, 0.0}, ": ");
    add({"motion 1 to 5 Hz", motion, 0.0, 0.0}, ": ");
  }
  all.push_back({"both: the same arcs", arcs, arcs, 1.0, 20.0, true});
  return all;
}

void disturb(Trace& first, Trace& second, double rate_hz, const Condition& condition, std::mt19937_64& generator) {
  const auto apply = [&](Trace& trace, const Disturb& what, std::size_t begin, std::size_t end, std::mt19937_64& by) {
    if (!what) return;
    MadeLead lead{rate_hz, trace, {}};
    what(lead, begin, end, by);
    trace = lead.mV;
  };
  const auto both = [&](std::size_t begin, std::size_t end) {
    std::mt19937_64 again = generator;
    apply(first, condition.first, begin, end, generator);
    apply(second, condition.second, begin, end, condition.together ? again : generator);
  };
  if (condition.longest_s == 0.0) {
    both(0, first.size());
    return;
  }
  const auto uniform = [&](double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(generator);
  };
  for (double at_s = kFirst_s;;) {
    const double length_s = std::exp(uniform(std::log(condition.shortest_s), std::log(condition.longest_s)));
    if (at_s + length_s + 8.0 > kLength_s) break;
    both(static_cast<std::size_t>(at_s * rate_hz), static_cast<std::size_t>((at_s + length_s) * rate_hz));
    at_s += length_s + uniform(10.0, 18.0);
  }
}

double f1_of(const RecordedLead& record, const Trace& first, const Trace& second) {
  EcgTrace trace{record.trace.time_s, first, second};
  const EcgAnalysis analysis = analyse(trace, [](std::size_t) { return true; });
  return score_beats(record.beats, analysis, trace).f1_percent.value_or(0.0);
}

}  // namespace

void print_two_leads(const std::vector<RecordedLead>& records, std::uint64_t seed) {
  for (const bool aside : {false, true}) {
    const std::vector<RecordedLead> part = part_of(records, aside, false);
    if (part.empty()) continue;
    fmt::print("| {} | first, F1 % | second | both | worst |\n|---|---|---|---|---|\n",
               aside ? "aside" : "development");
    std::mt19937_64 generator(seed);
    for (const Condition& condition : conditions()) {
      double first_f1 = 0.0;
      double second_f1 = 0.0;
      double both_f1 = 0.0;
      double worst = 0.0;
      const double n = static_cast<double>(part.size());
      for (const RecordedLead& record : part) {
        const double latest_s = record.trace.time_s.back() - kLength_s;
        const RecordedLead stretch =
            stretch_of(record, std::uniform_real_distribution<double>(0.0, latest_s)(generator), kLength_s);
        Trace first = stretch.trace.mV;
        Trace second = second_of(stretch, generator);
        disturb(first, second, stretch.rate_hz, condition, generator);
        const double by_first = f1_of(stretch, first, {});
        const double by_second = f1_of(stretch, second, {});
        const double by_both = f1_of(stretch, first, second);
        first_f1 += by_first / n;
        second_f1 += by_second / n;
        both_f1 += by_both / n;
        worst = std::min(worst, by_both - std::max(by_first, by_second));
      }
      fmt::print("| {} | {:.2f} | {:.2f} | {:.2f} | {:.2f} |\n", condition.name, first_f1, second_f1, both_f1, worst);
    }
    fmt::print("\n");
  }
}

}  // namespace perimap::test
