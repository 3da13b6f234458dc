#include "daemon/evaluation/ecg/beat_score.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "daemon/evaluation/ecg/ecg_analysis.hpp"
#include "drivers/ecg_file/beat_table.hpp"
#include "drivers/ecg_file/ecg_csv.hpp"
#include "drivers/standins/simulator/ecg_record.hpp"
#include "drivers/standins/simulator/embedded_data.hpp"

namespace perimap {
namespace {

// An R wave of 1 mV at 0.5 s beside noise that is larger where the stretch around the reference ends, but has its own
// peak outside; an unclassifiable beat at 0.8 s, found 100 ms early; and a normal one at 0.9 s, found 50 ms late and
// called noise.
TEST(BeatScore, TimesNormalBeatsByTheirLocalPeak) {
  EcgTrace trace;
  for (int i = 0; i < 1000; ++i) {
    const double t = 0.001 * i;
    const double r_wave = std::max(1.0 - std::abs(t - 0.5) / 0.020, 0.0);
    const double noise = 3.0 * std::max(1.0 - std::abs(t - 0.580) / 0.040, 0.0);
    trace.time_s.push_back(t);
    trace.mV.push_back(static_cast<float>(r_wave + noise));
  }
  const std::vector<ReferenceBeat> reference{{0.5, "N", ReferenceBeat::Kind::kNormal},
                                             {0.8, "Q", ReferenceBeat::Kind::kUnknown},
                                             {0.9, "N", ReferenceBeat::Kind::kNormal}};
  EcgAnalysis analysis;
  for (const double t : {0.502, 0.700, 0.950}) {
    AnalysedBeat beat;
    beat.peak.time = Instant(from_seconds(t));
    analysis.beats.push_back(beat);
  }
  analysis.beats.back().peak.beat_class = BeatClass::kNoise;
  const BeatScore score = score_beats(reference, analysis, trace);
  EXPECT_EQ(score.sensitivity.hits, 3);
  EXPECT_EQ(score.timed, 1);
  ASSERT_TRUE(score.timing_median_s);
  EXPECT_NEAR(*score.timing_median_s, 0.002, 1e-6);
  EXPECT_NEAR(score.timing_rms_s.value_or(-1.0), 0.0, 1e-6);
  ASSERT_TRUE(score.peak_rms_s);
  EXPECT_NEAR(*score.peak_rms_s, 0.002, 1e-6);
}

// A saturated R wave, flat from 0.49 to 0.51 s, with a shelf on its flank; what beat it is the reference does not say.
TEST(BeatScore, AFlatPeakIsAtItsMiddleAndAShelfIsNone) {
  EcgTrace trace;
  for (int i = 0; i < 1000; ++i) {
    const double t = 0.001 * i;
    const double flank = std::abs(t - 0.5) < 0.0105 ? 1.0 : std::max(0.9 - 20.0 * (std::abs(t - 0.5) - 0.0105), 0.0);
    trace.time_s.push_back(t);
    trace.mV.push_back(static_cast<float>(t > 0.520 && t < 0.5245 ? 0.65 : flank));
  }
  EcgAnalysis analysis;
  AnalysedBeat beat;
  beat.peak.time = Instant(from_seconds(0.503));
  analysis.beats.push_back(beat);
  for (const std::string symbol : {"", "beat"}) {
    const BeatScore score = score_beats({{0.5, symbol, ReferenceBeat::Kind::kUnknown}}, analysis, trace);
    EXPECT_EQ(score.timed, 1);
    ASSERT_TRUE(score.peak_rms_s);
    EXPECT_NEAR(*score.peak_rms_s, 0.003, 1e-6);
  }
  // Up to here the flank rises to the shelf, and no further in the stretch that is looked at.
  const BeatScore score = score_beats({{0.581, "", ReferenceBeat::Kind::kUnknown}}, analysis, trace);
  EXPECT_FALSE(score.peak_rms_s);
}

TEST(BeatScore, WhatThereIsNothingToTellFromIsNoFigure) {
  const ReferenceBeat normal{0.5, "N", ReferenceBeat::Kind::kNormal};
  const BeatScore nothing_found = score_beats({normal}, {}, {});
  EXPECT_EQ(nothing_found.sensitivity.percent(), 0.0);  // one was there to be found
  EXPECT_EQ(nothing_found.f1_percent, 0.0);
  EXPECT_FALSE(nothing_found.positive_predictivity.percent());
  EXPECT_FALSE(nothing_found.timing_median_s);
  EXPECT_FALSE(nothing_found.timing_rms_s);
  EXPECT_FALSE(nothing_found.peak_rms_s);
  EXPECT_FALSE(nothing_found.premature_sensitivity.percent());
  EXPECT_FALSE(nothing_found.premature_precision.percent());
  EXPECT_FALSE(score_beats({}, {}, {}).f1_percent);
  EXPECT_FALSE(delay_figures({}));
  EXPECT_FALSE(prediction_errors({}, {}).rms_s);
  EXPECT_FALSE(prediction_errors({}, {normal}).rms_s);
}

// What went on while samples were missing is no cycle.
TEST(BeatScore, NoPredictionIsHeldAgainstAnInterruption) {
  EcgAnalysis analysis;
  for (const double t : {1.0, 2.0, 30.0, 31.0}) {
    AnalysedBeat beat;
    beat.peak.time = Instant(from_seconds(t));
    beat.predicted_rr_s = {1.0, 1.0, 1.0};
    beat.after_interruption = t == 30.0;
    analysis.beats.push_back(beat);
  }
  const PredictionErrors errors = prediction_errors(analysis, {});
  EXPECT_EQ(errors.cycles, 2);
  ASSERT_TRUE(errors.rms_s);
  EXPECT_NEAR((*errors.rms_s)[0], 0.0, 1e-9);
}

// Three normal beats 1 s apart, of which the last was expected 50 ms late.
TEST(BeatScore, PredictionsAreHeldAgainstTheCyclesThatCame) {
  EcgAnalysis analysis;
  for (const double t : {1.0, 2.0, 3.0}) {
    AnalysedBeat beat;
    beat.peak.time = Instant(from_seconds(t));
    beat.peak.beat_class = BeatClass::kNormal;
    beat.peak.detected_at = Instant(from_seconds(t + 0.1));
    if (t == 2.0) beat.predicted_rr_s = {1.05, 0.98, 1.0};
    analysis.beats.push_back(beat);
  }
  const PredictionErrors errors = prediction_errors(analysis, {});
  EXPECT_EQ(errors.cycles, 1);
  ASSERT_TRUE(errors.rms_s);
  EXPECT_NEAR((*errors.rms_s)[0], 0.05, 1e-6);
  EXPECT_NEAR((*errors.rms_s)[1], 0.02, 1e-6);
  EXPECT_NEAR((*errors.rms_s)[2], 0.0, 1e-6);
  const auto delay = delay_figures(analysis);
  ASSERT_TRUE(delay);
  EXPECT_NEAR(delay->median_s, 0.1, 1e-6);
}

// ---- the whole way over real records, 30 minutes each, one set of parameters

struct Goal {
  const char* record;
  double f1_percent;
  double premature_percent;  // sensitivity and precision; 0: the record has no such figure to hold
};

struct Excerpt {
  EcgTrace trace;
  std::vector<ReferenceBeat> reference;
};

// Times count from the record's beginning.
Excerpt excerpt_of(const std::string& name, double begin_s, double end_s) {
  const auto inside = [&](double t) { return t >= begin_s && t < end_s; };
  Excerpt excerpt;
  const auto record = load_ecg_record(name);
  if (!record) return excerpt;
  for (std::size_t i = 0; i < record->samples.size(); ++i) {
    const double t = static_cast<double>(i) / record->sample_rate_hz;
    if (!inside(t)) continue;
    excerpt.trace.time_s.push_back(t);
    excerpt.trace.mV.push_back(record->mV(i));
  }
  for (const EmbeddedEcgRecord& embedded : embedded_ecg_records()) {
    if (embedded.name != name) continue;
    const auto beats = parse_beat_table(embedded.beats_csv, "beats");
    if (!beats) continue;
    std::copy_if(beats->beats.begin(), beats->beats.end(), std::back_inserter(excerpt.reference),
                 [&](const ReferenceBeat& beat) { return inside(beat.time_s); });
  }
  return excerpt;
}

class WholeRecord : public testing::TestWithParam<Goal> {};

TEST_P(WholeRecord, MeetsItsFigures) {
  const Goal& goal = GetParam();
  const auto [trace, reference] = excerpt_of(goal.record, 0.0, 1e6);
  ASSERT_FALSE(reference.empty());
  const EcgAnalysis analysis = analyse(trace, [](std::size_t) { return true; });
  const BeatScore score = score_beats(reference, analysis, trace);
  EXPECT_GE(score.f1_percent, goal.f1_percent);
  const auto delay = delay_figures(analysis);
  ASSERT_TRUE(delay);
  EXPECT_LE(delay->median_s, 0.120);
  EXPECT_LE(delay->p95_s, 0.200);
  ASSERT_TRUE(score.peak_rms_s);
  EXPECT_LE(*score.peak_rms_s, 0.006);
  const auto normal = std::count_if(reference.begin(), reference.end(), [](const ReferenceBeat& beat) {
    return beat.kind == ReferenceBeat::Kind::kNormal;
  });
  EXPECT_GE(score.timed, 0.994 * static_cast<double>(normal));
  if (goal.premature_percent > 0.0) {
    EXPECT_GE(score.premature_sensitivity.percent(), goal.premature_percent);
    EXPECT_GE(score.premature_precision.percent(), goal.premature_percent);
  }
  const PredictionErrors errors = prediction_errors(analysis, reference);
  ASSERT_TRUE(errors.rms_s);
  const auto& [previous, mean_of_8, autoregressive] = *errors.rms_s;
  EXPECT_LE(autoregressive, 1.02 * std::min(previous, mean_of_8));
  if (goal.record[2] == '0' || goal.record[2] == '3') {
    EXPECT_LE(autoregressive, 0.85 * previous);
  }
}

INSTANTIATE_TEST_SUITE_P(Embedded, WholeRecord,
                         testing::Values(Goal{"100", 100.0, 0.0}, Goal{"105", 99.4, 0.0}, Goal{"106", 99.8, 95.0},
                                         Goal{"119", 100.0, 95.0}, Goal{"123", 99.965, 0.0},
                                         Goal{"03700181", 100.0, 0.0}),
                         [](const auto& goal) { return std::string(goal.param.record); });

// A session may begin anywhere: in bigeminy two of the first three intervals are the short ones.
struct Start {
  const char* record;
  double begin_s;
};

class BeginningInBigeminy : public testing::TestWithParam<Start> {};

TEST_P(BeginningInBigeminy, TellsBeatsFromTheirWaves) {
  const auto [trace, reference] = excerpt_of(GetParam().record, GetParam().begin_s, GetParam().begin_s + 30.0);
  ASSERT_GT(reference.size(), 20U);
  const EcgAnalysis analysis = analyse(trace, [](std::size_t) { return true; });
  EXPECT_GE(score_beats(reference, analysis, trace).f1_percent, 95.0);
}

INSTANTIATE_TEST_SUITE_P(Embedded, BeginningInBigeminy,
                         testing::Values(Start{"119", 1322.65}, Start{"119", 1330.92}, Start{"119", 1613.37}),
                         [](const auto& start) { return "Start" + std::to_string(start.index); });

}  // namespace
}  // namespace perimap
