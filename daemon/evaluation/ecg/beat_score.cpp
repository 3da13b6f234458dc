#include "daemon/evaluation/ecg/beat_score.hpp"

#include <algorithm>
#include <cmath>

#include "core/statistics/nearest_pairs.hpp"
#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr double kPeakWithin_s = 0.060;

double seconds_of(Instant t) { return to_seconds(t.time_since_epoch()); }

bool has_kinds(const std::vector<ReferenceBeat>& reference) {
  return std::any_of(reference.begin(), reference.end(),
                     [](const ReferenceBeat& beat) { return beat.kind != ReferenceBeat::Kind::kUnknown; });
}

// Whether the times of a beat and of the detection that is it count: see BeatScore.
bool is_timed(const ReferenceBeat& beat, bool kinds, const RPeak& peak) {
  return (!kinds || beat.kind == ReferenceBeat::Kind::kNormal) && peak.beat_class != BeatClass::kNoise;
}

// The local peak farthest from the signal's median within 60 ms of t. The end of that stretch is none: there the signal
// may be on its way to a larger excursion outside.
std::optional<double> peak_near(const EcgTrace& trace, double t) {
  const auto begin = std::lower_bound(trace.time_s.begin(), trace.time_s.end(), t - kPeakWithin_s);
  const auto end = std::upper_bound(begin, trace.time_s.end(), t + kPeakWithin_s);
  if (begin == end) return std::nullopt;
  const auto first = static_cast<std::size_t>(begin - trace.time_s.begin());
  std::vector<float> values(trace.mV.begin() + (begin - trace.time_s.begin()),
                            trace.mV.begin() + (end - trace.time_s.begin()));
  if (std::any_of(values.begin(), values.end(), [](float v) { return !std::isfinite(v); })) return std::nullopt;
  auto sorted = values;
  const float median = upper_median(sorted.begin(), sorted.end());
  for (float& value : values) value -= median;
  std::optional<std::size_t> peak;
  for (std::size_t i = 1, after = 2; after < values.size(); i = after++) {
    // A saturated peak is flat.
    while (after < values.size() && values[after] == values[i]) ++after;
    if (after == values.size()) break;
    const float side = values[i] < 0.0F ? -1.0F : 1.0F;
    const bool turns = side * values[i] > side * values[i - 1] && side * values[i] > side * values[after];
    if (turns && (!peak || std::abs(values[i]) > std::abs(values[*peak]))) peak = (i + after - 1) / 2;
  }
  if (!peak) return std::nullopt;
  return trace.time_s[first + *peak];
}

// Of at least one value.
double root_mean_square(const std::vector<double>& values) {
  double squares = 0.0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

}  // namespace

std::vector<int> match_beats(const std::vector<ReferenceBeat>& reference, const std::vector<AnalysedBeat>& beats) {
  std::vector<double> reference_s;
  std::vector<double> found_s;
  for (const ReferenceBeat& beat : reference) reference_s.push_back(beat.time_s);
  for (const AnalysedBeat& beat : beats) found_s.push_back(seconds_of(beat.peak.time));
  return nearest_pairs(reference_s, found_s, BeatScore::kWindow_s);
}

BeatScore score_beats(const std::vector<ReferenceBeat>& reference, const EcgAnalysis& analysis, const EcgTrace& trace) {
  const auto& beats = analysis.beats;
  const std::vector<int> matched = match_beats(reference, analysis.beats);
  BeatScore score;
  score.has_kinds = has_kinds(reference);
  std::vector<bool> used(beats.size(), false);
  std::vector<double> apart_s;
  std::vector<double> from_peak_s;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const ReferenceBeat& beat = reference[i];
    const bool premature = beat.kind == ReferenceBeat::Kind::kPremature;
    if (premature) ++score.premature_sensitivity.all;
    auto& counts = score.symbols[beat.symbol];
    if (matched[i] < 0) {
      score.missed_s.push_back(beat.time_s);
      ++counts[4];
      continue;
    }
    used[static_cast<std::size_t>(matched[i])] = true;
    const RPeak& peak = beats[static_cast<std::size_t>(matched[i])].peak;
    ++counts[static_cast<std::size_t>(peak.beat_class)];
    if (premature && peak.beat_class == BeatClass::kPremature) {
      ++score.premature_sensitivity.hits;
      ++score.premature_precision.hits;
    }
    if (!is_timed(beat, score.has_kinds, peak)) continue;
    apart_s.push_back(seconds_of(peak.time) - beat.time_s);
    if (const auto t = peak_near(trace, beat.time_s)) from_peak_s.push_back(seconds_of(peak.time) - *t);
  }
  for (std::size_t j = 0; j < beats.size(); ++j) {
    if (beats[j].peak.beat_class == BeatClass::kPremature) ++score.premature_precision.all;
    if (!used[j]) score.extra_s.push_back(seconds_of(beats[j].peak.time));
  }
  const int found = static_cast<int>(reference.size() - score.missed_s.size());
  score.sensitivity = {found, static_cast<int>(reference.size())};
  score.positive_predictivity = {found, static_cast<int>(beats.size())};
  const int both = static_cast<int>(reference.size() + beats.size());
  if (both > 0) score.f1_percent = 200.0 * found / both;

  score.timed = static_cast<int>(apart_s.size());
  if (!apart_s.empty()) {
    auto sorted = apart_s;
    const double median_s = upper_median(sorted.begin(), sorted.end());
    for (double& apart : apart_s) apart -= median_s;
    score.timing_median_s = median_s;
    score.timing_rms_s = root_mean_square(apart_s);
  }
  if (!from_peak_s.empty()) score.peak_rms_s = root_mean_square(from_peak_s);
  return score;
}

PredictionErrors prediction_errors(const EcgAnalysis& analysis, const std::vector<ReferenceBeat>& reference) {
  PredictionErrors errors;
  std::array<double, 3> squares{};
  const auto take = [&](const AnalysedBeat& begin, const AnalysedBeat& end) {
    if (end.after_interruption || begin.predicted_rr_s[0] <= 0.0 || begin.predicted_rr_s[2] <= 0.0) return;
    const double rr_s = to_seconds(end.peak.time - begin.peak.time);
    for (std::size_t i = 0; i < squares.size(); ++i) {
      squares[i] += (begin.predicted_rr_s[i] - rr_s) * (begin.predicted_rr_s[i] - rr_s);
    }
    ++errors.cycles;
  };
  if (reference.empty()) {
    const AnalysedBeat* last = nullptr;
    for (const AnalysedBeat& beat : analysis.beats) {
      if (beat.peak.beat_class == BeatClass::kNoise) continue;
      const bool normal = beat.peak.beat_class == BeatClass::kNormal;
      if (normal && last != nullptr && last->peak.beat_class == BeatClass::kNormal) take(*last, beat);
      last = &beat;
    }
  } else {
    const std::vector<int> matched = match_beats(reference, analysis.beats);
    const bool kinds = has_kinds(reference);
    const AnalysedBeat* last = nullptr;
    for (std::size_t i = 0; i < reference.size(); ++i) {
      const AnalysedBeat* beat = matched[i] < 0 ? nullptr : &analysis.beats[static_cast<std::size_t>(matched[i])];
      if (beat != nullptr && !is_timed(reference[i], kinds, beat->peak)) beat = nullptr;
      if (last != nullptr && beat != nullptr) take(*last, *beat);
      last = beat;
    }
  }
  if (errors.cycles == 0) return errors;
  for (double& rms : squares) rms = std::sqrt(rms / errors.cycles);
  errors.rms_s = squares;
  return errors;
}

std::optional<DelayFigures> delay_figures(const EcgAnalysis& analysis) {
  std::vector<double> delays_s;
  for (const AnalysedBeat& beat : analysis.beats) {
    delays_s.push_back(to_seconds(beat.peak.detected_at - beat.peak.time));
  }
  if (delays_s.empty()) return std::nullopt;
  std::sort(delays_s.begin(), delays_s.end());
  const auto at = [&](double q) {
    return delays_s[static_cast<std::size_t>(q * static_cast<double>(delays_s.size() - 1))];
  };
  return DelayFigures{at(0.5), at(0.95)};
}

}  // namespace perimap
