// R times against the local peaks of the signal, by two measures of which peak is meant.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "daemon/evaluation/ecg/beat_score.hpp"
#include "tables.hpp"

namespace perimap::test {
namespace {

constexpr double kWithin_s = 0.060;
constexpr double kShareOfFarthest = 0.25;
constexpr double kFar_s = 0.005;
constexpr double kAnywhere_s = 0.08;  // deviation of beats that are told as anywhere within 150 ms

// The local extrema about a time: times, and how far each is from the median of the stretch.
struct Extremum {
  double time_s = 0.0;
  double height_mV = 0.0;
};

// Of the mean of three samples: the last bit of a converter makes extrema of its own.
std::vector<Extremum> extrema_about(const EcgTrace& trace, double t) {
  const auto at = [&](double time_s) {
    return std::lower_bound(trace.time_s.begin(), trace.time_s.end(), time_s) - trace.time_s.begin();
  };
  const auto first = static_cast<std::size_t>(std::max<std::ptrdiff_t>(at(t - kWithin_s), 1));
  const auto last = std::min(static_cast<std::size_t>(at(t + kWithin_s)), trace.mV.size() - 1);
  std::vector<double> values;
  for (std::size_t i = first; i < last; ++i) {
    values.push_back(static_cast<double>(trace.mV[i - 1] + trace.mV[i] + trace.mV[i + 1]) / 3.0);
  }
  std::vector<Extremum> extrema;
  if (values.size() < 3) return extrema;
  std::vector<double> sorted = values;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double median = sorted[sorted.size() / 2];
  for (std::size_t i = 1, after = 2; after < values.size(); i = after++) {
    while (after < values.size() && values[after] == values[i]) ++after;
    if (after == values.size()) break;
    const double side = values[i] < median ? -1.0 : 1.0;
    if (side * values[i] <= side * values[i - 1] || side * values[i] <= side * values[after]) continue;
    extrema.push_back({trace.time_s[first + (i + after - 1) / 2], std::abs(values[i] - median)});
  }
  return extrema;
}

struct RootMeanSquare {
  double squares = 0.0;
  int count = 0;
  void add(double value) {
    squares += value * value;
    ++count;
  }
  [[nodiscard]] double value() const { return std::sqrt(squares / std::max(count, 1)); }
};

}  // namespace

void print_peak_times(const std::vector<RecordedLead>& records) {
  fmt::print(
      "| record | farthest, ms RMS | nearest, ms RMS | beats more than {:.0f} ms from the nearest | told as anywhere "
      "within "
      "150 ms | nearest of the others, ms RMS |\n"
      "|---|---|---|---|---|---|\n",
      1e3 * kFar_s);
  RootMeanSquare of_all;
  for (const RecordedLead& record : records) {
    const EcgAnalysis analysis = analysed(record);
    const std::vector<int> matched = match_beats(record.beats, analysis.beats);
    RootMeanSquare farthest;
    RootMeanSquare nearest;
    RootMeanSquare located;
    int far = 0;
    for (std::size_t i = 0; i < record.beats.size(); ++i) {
      if (matched[i] < 0 || record.beats[i].kind != ReferenceBeat::Kind::kNormal) continue;
      const RPeak& peak = analysis.beats[static_cast<std::size_t>(matched[i])].peak;
      if (peak.beat_class == BeatClass::kNoise) continue;
      std::vector<Extremum> extrema = extrema_about(record.trace, record.beats[i].time_s);
      if (extrema.empty()) continue;
      const double t = to_seconds(peak.time.time_since_epoch());
      const auto highest = std::max_element(extrema.begin(), extrema.end(), [](const Extremum& a, const Extremum& b) {
        return a.height_mV < b.height_mV;
      });
      farthest.add(t - highest->time_s);
      const double least_mV = kShareOfFarthest * highest->height_mV;
      std::erase_if(extrema, [&](const Extremum& extremum) { return extremum.height_mV < least_mV; });
      const auto next = std::min_element(extrema.begin(), extrema.end(), [&](const Extremum& a, const Extremum& b) {
        return std::abs(a.time_s - record.beats[i].time_s) < std::abs(b.time_s - record.beats[i].time_s);
      });
      nearest.add(t - next->time_s);
      of_all.add(t - next->time_s);
      if (to_seconds(peak.deviation) < kAnywhere_s) located.add(t - next->time_s);
      far += std::abs(t - next->time_s) > kFar_s ? 1 : 0;
    }
    fmt::print("| {}{} | {:.1f} | {:.1f} | {} of {} | {} | {:.1f} |\n", record.name, record.aside ? ", aside" : "",
               1e3 * farthest.value(), 1e3 * nearest.value(), far, nearest.count, nearest.count - located.count,
               1e3 * located.value());
  }
  fmt::print("| all beats together | | {:.1f} | | | |\n", 1e3 * of_all.value());
}

}  // namespace perimap::test
