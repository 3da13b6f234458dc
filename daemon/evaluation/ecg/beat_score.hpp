// Detected beats against reference beats.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/evaluation/ecg/ecg_analysis.hpp"
#include "drivers/ecg_file/beat_table.hpp"
#include "drivers/ecg_file/ecg_trace.hpp"

namespace perimap {

// Of two numbers that make a rate: hits of all.
struct Rate {
  int hits = 0;
  int all = 0;

  // None of nothing.
  [[nodiscard]] std::optional<double> percent() const noexcept {
    if (all == 0) return std::nullopt;
    return 100.0 * hits / all;
  }
};

// A figure that there is nothing to tell from is not there.
struct BeatScore {
  static constexpr double kWindow_s = 0.150;  // ANSI/AAMI EC57

  Rate sensitivity;            // reference beats found
  Rate positive_predictivity;  // detections that are reference beats
  std::optional<double> f1_percent;
  std::vector<double> missed_s;
  std::vector<double> extra_s;

  // Detected minus reference time of the normal beats that were found (of all where the reference has no kinds), about
  // its median; and to the largest local peak of the signal within 60 ms of the reference. Without those classed as
  // noise, whose times nothing goes by; they count as found all the same.
  int timed = 0;  // beats
  std::optional<double> timing_median_s;
  std::optional<double> timing_rms_s;
  std::optional<double> peak_rms_s;

  bool has_kinds = false;
  Rate premature_sensitivity;
  Rate premature_precision;
  std::map<std::string, std::array<int, 5>> symbols;  // as normal, premature, pause, noise; missed
};

// For each reference beat the index of the detection that is it, or -1: at most one each way, nearest first.
[[nodiscard]] std::vector<int> match_beats(const std::vector<ReferenceBeat>& reference,
                                           const std::vector<AnalysedBeat>& beats);

[[nodiscard]] BeatScore score_beats(const std::vector<ReferenceBeat>& reference, const EcgAnalysis& analysis,
                                    const EcgTrace& trace);

// One-step prediction of the length of cycles from a normal beat to a normal beat: by the reference where there is one
// (both beats found), else by class.
struct PredictionErrors {
  int cycles = 0;
  std::optional<std::array<double, 3>> rms_s;  // of kPredictionMethods; where there are cycles
};

[[nodiscard]] PredictionErrors prediction_errors(const EcgAnalysis& analysis,
                                                 const std::vector<ReferenceBeat>& reference);

// Median and 95 % quantile from R peak to detection.
struct DelayFigures {
  double median_s = 0.0;
  double p95_s = 0.0;
};

// None without beats.
[[nodiscard]] std::optional<DelayFigures> delay_figures(const EcgAnalysis& analysis);

}  // namespace perimap
