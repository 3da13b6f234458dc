#include "daemon/evaluation/ecg/ecg_text.hpp"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <string_view>

#include "core/time/instant.hpp"

namespace perimap {
namespace {

std::string_view name_of(BeatClass beat_class) {
  switch (beat_class) {
    case BeatClass::kNormal:
      return "normal";
    case BeatClass::kPremature:
      return "premature";
    case BeatClass::kPause:
      return "pause";
    case BeatClass::kNoise:
      return "noise";
  }
  return "";
}

std::string_view name_of(RrMethod method) {
  switch (method) {
    case RrMethod::kPrevious:
      return "previous";
    case RrMethod::kMeanOf8:
      return "mean_of_8";
    case RrMethod::kAutoregressive:
      return "autoregressive";
  }
  return "";
}

double seconds(Instant t) { return to_seconds(t.time_since_epoch()); }

std::array<int, 4> count_classes(const EcgAnalysis& analysis) {
  std::array<int, 4> classes{};
  for (const AnalysedBeat& beat : analysis.beats) ++classes[static_cast<std::size_t>(beat.peak.beat_class)];
  return classes;
}

nlohmann::json milliseconds(std::optional<double> s) { return s ? nlohmann::json(1e3 * *s) : nlohmann::json(nullptr); }

nlohmann::json to_json(std::optional<double> figure) {
  return figure ? nlohmann::json(*figure) : nlohmann::json(nullptr);
}

nlohmann::json to_json(const Rate& rate) {
  return {{"percent", to_json(rate.percent())}, {"hits", rate.hits}, {"of", rate.all}};
}

std::string to_text(const Rate& rate) {
  const auto percent = rate.percent();
  return fmt::format("{} ({} of {})", percent ? fmt::format("{:.2f} %", *percent) : "none", rate.hits, rate.all);
}

}  // namespace

std::string beat_rows(const EcgAnalysis& analysis) {
  std::string rows = "time_s,class,confidence,detected_at_s\n";
  for (const AnalysedBeat& beat : analysis.beats) {
    rows += fmt::format("{:.5f},{},{:.3f},{:.5f}\n", seconds(beat.peak.time), name_of(beat.peak.beat_class),
                        beat.peak.confidence, seconds(beat.peak.detected_at));
  }
  return rows;
}

nlohmann::json to_json(const EcgAnalysis& analysis, const PredictionErrors& errors) {
  const auto delay = delay_figures(analysis);
  const auto classes = count_classes(analysis);
  const auto delay_ms = [&](double DelayFigures::*figure) {
    return delay ? milliseconds((*delay).*figure) : nlohmann::json(nullptr);
  };
  nlohmann::json json = {
      {"duration_s", analysis.duration_s},
      {"beats", analysis.beats.size()},
      {"classes", {{"normal", classes[0]}, {"premature", classes[1]}, {"pause", classes[2]}, {"noise", classes[3]}}},
      {"delay_ms", {{"median", delay_ms(&DelayFigures::median_s)}, {"p95", delay_ms(&DelayFigures::p95_s)}}},
      {"unusable_s", analysis.unusable_s},
      {"interruptions", analysis.interruptions},
      {"without_beats_s", analysis.without_beats_s},
      {"noisy_s", analysis.noisy_s},
      {"unpredictable_s", analysis.unpredictable_s},
      {"prediction", {{"cycles", errors.cycles}}}};
  for (const LeadUse& lead : analysis.leads) {
    json["leads"].push_back(
        {{"unusable_s", lead.unusable_s}, {"without_beats_s", lead.without_beats_s}, {"noisy_s", lead.noisy_s}});
  }
  for (std::size_t i = 0; i < kPredictionMethods.size(); ++i) {
    json["prediction"][std::string(name_of(kPredictionMethods[i])) + "_rms_ms"] =
        errors.rms_s ? milliseconds((*errors.rms_s)[i]) : nlohmann::json(nullptr);
  }
  return json;
}

nlohmann::json to_json(const BeatScore& score, std::size_t left_out) {
  nlohmann::json json = {{"sensitivity", to_json(score.sensitivity)},
                         {"positive_predictivity", to_json(score.positive_predictivity)},
                         {"f1_percent", to_json(score.f1_percent)},
                         {"annotations_left_out", left_out},
                         {"missed_s", score.missed_s},
                         {"extra_s", score.extra_s},
                         {"timing_ms",
                          {{"beats", score.timed},
                           {"median", milliseconds(score.timing_median_s)},
                           {"rms", milliseconds(score.timing_rms_s)},
                           {"to_local_peak_rms", milliseconds(score.peak_rms_s)}}}};
  if (!score.has_kinds) return json;
  json["premature"] = {{"sensitivity", to_json(score.premature_sensitivity)},
                       {"precision", to_json(score.premature_precision)}};
  for (const auto& [symbol, counts] : score.symbols) {
    json["symbols"][symbol] = {{"normal", counts[0]},
                               {"premature", counts[1]},
                               {"pause", counts[2]},
                               {"noise", counts[3]},
                               {"missed", counts[4]}};
  }
  return json;
}

std::string to_text(const EcgAnalysis& analysis, const PredictionErrors& errors) {
  const auto classes = count_classes(analysis);
  std::string text =
      fmt::format("beats       {} in {:.1f} s: {} normal, {} premature, {} after a pause, {} thought noise\n",
                  analysis.beats.size(), analysis.duration_s, classes[0], classes[1], classes[2], classes[3]);
  const auto delay = delay_figures(analysis);
  text += "delay       R peak to detection, median / 95 %: ";
  text += delay ? fmt::format("{:.0f} / {:.0f} ms\n", 1e3 * delay->median_s, 1e3 * delay->p95_s) : "none\n";
  text += fmt::format(
      "signal      unusable for {:.1f} s, interrupted {} times, without beats for {:.1f} s, noisy for {:.1f} s; rhythm "
      "unpredictable for {:.1f} s\n",
      analysis.unusable_s, analysis.interruptions, analysis.without_beats_s, analysis.noisy_s,
      analysis.unpredictable_s);
  for (std::size_t lead = 0; lead < analysis.leads.size(); ++lead) {
    const LeadUse& use = analysis.leads[lead];
    text += fmt::format("            {} lead: unusable for {:.1f} s, without beats for {:.1f} s, noisy for {:.1f} s\n",
                        lead == 0 ? "first" : "second", use.unusable_s, use.without_beats_s, use.noisy_s);
  }
  if (!errors.rms_s) return text + "prediction  next cycle: none, there are no normal cycles to tell it from\n";
  const auto& rms_s = *errors.rms_s;
  return text + fmt::format(
                    "prediction  next cycle, RMS over {} normal cycles: previous {:.1f}, mean of 8 {:.1f}, "
                    "autoregressive {:.1f} ms\n",
                    errors.cycles, 1e3 * rms_s[0], 1e3 * rms_s[1], 1e3 * rms_s[2]);
}

std::string to_text(const BeatScore& score, std::size_t left_out) {
  std::string text = fmt::format("reference   sensitivity {}, positive predictivity {}, F1 {}\n",
                                 to_text(score.sensitivity), to_text(score.positive_predictivity),
                                 score.f1_percent ? fmt::format("{:.3f} %", *score.f1_percent) : "none");
  if (left_out > 0) text += fmt::format("            annotations in it that are no beats, left out: {}\n", left_out);
  text += "timing      normal beats to the reference: ";
  text += score.timing_median_s ? fmt::format("median {:+.1f} ms, RMS about it {:.1f} ms", 1e3 * *score.timing_median_s,
                                              1e3 * *score.timing_rms_s)
                                : "none";
  if (score.peak_rms_s) text += fmt::format("; to the local peak: RMS {:.1f} ms", 1e3 * *score.peak_rms_s);
  text += '\n';
  if (!score.has_kinds) return text;
  text += fmt::format("premature   sensitivity {}, precision {}\n", to_text(score.premature_sensitivity),
                      to_text(score.premature_precision));
  for (const auto& [symbol, counts] : score.symbols) {
    text += fmt::format("  {:<9} normal {}, premature {}, pause {}, noise {}, missed {}\n", symbol, counts[0],
                        counts[1], counts[2], counts[3], counts[4]);
  }
  return text;
}

}  // namespace perimap
