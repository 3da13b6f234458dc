#include "core/phase/heart_phase.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <random>

#include "core/angle/angle.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using Costs = std::array<double, kPhaseLaws.size()>;  // linear, warped, time-locked

constexpr Costs kWarpedExplains{80.0, 20.0, 60.0};
constexpr Costs kLinearExplains{20.0, 80.0, 80.0};

// A heart that runs evenly from R peak to R peak, 0.8 s apart by chance; the ECG's R peaks are off by chance, and the
// images show the phase. Frames come every 33 ms.
struct Heart : ::testing::Test {
  static constexpr double kSeenDeviation_s = 2e-3;

  HeartPhaseSettings settings;
  std::unique_ptr<HeartPhase> heart;
  CardiacClockTracker tracker{CardiacClockSettings{}};
  std::mt19937 generator{11};
  Instant begin{std::chrono::seconds(5)};  // of the running cycle, truly
  Instant frame = begin;
  HeartPhase::Change change;  // of the last frame
  int beats_told = 0;         // frames that told of one
  bool sees = true;           // the images tell the phase
  bool hears = false;         // there are samples, up to each frame; else R peaks alone
  double rr_scatter_s = 0.02;

  void make() { heart = std::make_unique<HeartPhase>(settings, tracker.clock().beats()); }

  double normal(double deviation) { return std::normal_distribution<double>(0.0, deviation)(generator); }

  void next_frame() {
    frame += milliseconds(33);
    if (hears) tracker.heard(frame);
    change = heart->begin_frame(tracker.clock(), frame + milliseconds(12), frame);
    if (change.beat) ++beats_told;
  }

  // The R peak at the end of this cycle is known with the first frame after it.
  void next_cycle() {
    const Duration length = from_seconds(0.8 + normal(rr_scatter_s));
    while (frame + milliseconds(33) < begin + length) {
      next_frame();
      const double rate = kTwoPi / to_seconds(length);
      const double seen_rad = rate * (to_seconds(frame - begin) + normal(kSeenDeviation_s));
      if (sees) heart->observe({ImagePhaseOutcome::kObserved, {frame, seen_rad, rate * kSeenDeviation_s}});
    }
    begin += length;
    const Instant heard = begin + from_seconds(normal(1.5e-3));
    tracker.on_r_peak({heard, heard, 1.0, std::chrono::microseconds(1500)});
  }
  void run(int cycles) {
    if (heart == nullptr) make();
    for (int i = 0; i < cycles; ++i) next_cycle();
    next_frame();
  }
  // Of a cycle that is longer than predicted.
  void see_frames(int frames, ImagePhaseOutcome outcome = ImagePhaseOutcome::kObserved) {
    const double rate = kTwoPi / 0.83;
    for (int i = 0; i < frames; ++i) {
      heart->observe({outcome, {frame, rate * to_seconds(frame - begin), rate * kSeenDeviation_s}});
      next_frame();
    }
  }
  void try_laws(std::size_t features, const Costs& costs) {
    for (std::size_t i = 0; i < features; ++i) heart->add({costs, frame - std::chrono::seconds(2), frame});
  }
};

void expect_same(const CardiacClock& a, const CardiacClock& b, Instant from) {
  for (Instant t = from - std::chrono::seconds(2); t < from + std::chrono::seconds(2); t += milliseconds(7)) {
    const PhaseEstimate left = a.at(t);
    const PhaseEstimate right = b.at(t);
    ASSERT_EQ(left.phase_rad, right.phase_rad);
    ASSERT_EQ(left.deviation_s, right.deviation_s);
    ASSERT_EQ(left.state, right.state);
    ASSERT_EQ(left.law_undecided, right.law_undecided);
  }
}

TEST_F(Heart, TheClockIsTheOneThatOthersMakeOfTheBelief) {
  settings.law_from_image = true;
  run(12);
  see_frames(5);
  ASSERT_NE(heart->clock().at(frame).phase_rad, heart->by_ecg().at(frame).phase_rad) << "nothing is corrected";
  const PhaseBelief belief = heart->belief();
  ASSERT_TRUE(belief.law.has_value());
  expect_same(heart->clock(), belief.clock(tracker.clock(), frame + milliseconds(12)), frame);
  // Whoever asks when the ECG has been silent since knows that it is gone, whatever the belief.
  CardiacClockTracker heard = tracker;
  heard.heard(frame);
  EXPECT_EQ(belief.clock(heard.clock(), frame + milliseconds(50)).at(frame).state, PhaseState::kLocked);
  EXPECT_NE(belief.clock(heard.clock(), frame + milliseconds(400)).at(frame).state, PhaseState::kLocked);
}

TEST_F(Heart, WhatIsObservedCorrectsTheBeliefAndNotWhatTheEcgTells) {
  sees = false;
  run(12);
  expect_same(heart->clock(), heart->by_ecg(), frame);
  see_frames(8, ImagePhaseOutcome::kTentative);
  expect_same(heart->clock(), heart->by_ecg(), frame);
  see_frames(8);
  EXPECT_GT(heart->clock().predicted_length(), heart->by_ecg().predicted_length() + milliseconds(5));
  EXPECT_FALSE(heart->clock().at(frame).contradicted);
  heart->observe({ImagePhaseOutcome::kContradicts, {}});
  next_frame();
  EXPECT_TRUE(heart->clock().at(frame).contradicted);
}

TEST_F(Heart, ABeatIsToldWithTheFirstFrameAfterItAndOnce) {
  run(20);
  EXPECT_EQ(beats_told, 20);
  EXPECT_TRUE(change.beat);
  next_frame();
  EXPECT_FALSE(change.beat);
  EXPECT_EQ(heart->beats(), tracker.clock().beats());
}

TEST_F(Heart, BeatsOfThePatientBeforeEndNoCycleOfThisOne) {
  settings.law_from_image = true;
  run(20);
  *heart = HeartPhase(settings, heart->beats());
  next_frame();
  EXPECT_FALSE(change.beat);
  EXPECT_EQ(heart->belief().cycle.beats, 0U);
  expect_same(heart->clock(), heart->by_ecg(), frame);
  // As after an ECG thread that has forgotten the patient as well.
  tracker = CardiacClockTracker(CardiacClockSettings{});
  next_frame();
  EXPECT_FALSE(usable(heart->clock().at(frame).state));
}

TEST_F(Heart, ALawThatIsFoundIsToldOfAndCompletedCyclesAreToldByIt) {
  settings.law_from_image = true;
  sees = false;
  run(12);
  try_laws(20, kWarpedExplains);
  next_frame();
  EXPECT_TRUE(change.another_law);
  EXPECT_TRUE(change.other_laws);
  EXPECT_EQ(heart->by_ecg().law().law, PhaseLaw::kWarped);
  EXPECT_EQ(heart->clock().law().law, PhaseLaw::kWarped);
  EXPECT_EQ(heart->belief().law->settings.law, PhaseLaw::kWarped);
  next_frame();
  EXPECT_FALSE(change.another_law || change.other_laws) << "trials count once";
}

TEST_F(Heart, ALawThatIsConfiguredStays) {
  run(12);
  try_laws(20, kWarpedExplains);
  next_frame();
  EXPECT_FALSE(change.another_law || change.other_laws);
  EXPECT_FALSE(heart->belief().law.has_value());
  EXPECT_EQ(heart->clock().law().law, PhaseLaw::kLinear);
}

TEST_F(Heart, TrialsWaitForMoreOfThemAndForAnEcgThatTellsThePhase) {
  settings.law_from_image = true;
  hears = true;
  sees = false;
  run(12);
  try_laws(LawChoice::kFewestTrials - 1, kWarpedExplains);
  next_frame();
  EXPECT_FALSE(change.another_law) << "too few";
  hears = false;
  tracker.interrupt();
  try_laws(20, kWarpedExplains);
  next_frame();
  EXPECT_FALSE(change.another_law) << "the ECG is gone";
  hears = true;
  for (int i = 0; i < 4; ++i) next_cycle();
  EXPECT_EQ(heart->clock().law().law, PhaseLaw::kWarped) << "locked again";
}

TEST_F(Heart, MoreTrialsThanThereIsRoomForAreLeftOut) {
  settings.law_from_image = true;
  sees = false;
  run(12);
  try_laws(2 * HeartPhase::kMostTrials, kWarpedExplains);
  next_frame();
  EXPECT_TRUE(change.another_law);
}

TEST_F(Heart, TrialsThatWereWeighedMakeRoomForOthers) {
  settings.law_from_image = true;
  sees = false;
  run(12);
  for (std::size_t tried = 0; tried < HeartPhase::kMostTrials; tried += 64) {
    try_laws(64, kLinearExplains);
    run(4);
  }
  ASSERT_EQ(heart->by_ecg().law().law, PhaseLaw::kLinear);
  for (int i = 0; i < 15 && heart->by_ecg().law().law == PhaseLaw::kLinear; ++i) {
    try_laws(64, kWarpedExplains);
    run(4);
  }
  EXPECT_EQ(heart->by_ecg().law().law, PhaseLaw::kWarped);
}

TEST_F(Heart, ALawThatIsFoundInTheFrameThatKnowsABeatIsToldOf) {
  settings.law_from_image = true;
  sees = false;
  run(12);
  next_cycle();
  try_laws(20, kWarpedExplains);
  next_frame();
  EXPECT_TRUE(change.beat);
  EXPECT_TRUE(change.another_law);
}

// Moved R peaks are for completed cycles alone: neither what is searched by nor what is published goes by them.
TEST_F(Heart, CompletedCyclesLieBetweenMovedRPeaks) {
  run(40);
  EXPECT_NE(heart->completed().anchor(), heart->by_ecg().anchor());
  EXPECT_LT(heart->completed().anchor_deviation(), heart->by_ecg().anchor_deviation());
  const Instant within = heart->by_ecg().anchor() - milliseconds(100);
  EXPECT_NE(heart->completed().cycle_at(within).begin, heart->by_ecg().cycle_at(within).begin);
  EXPECT_EQ(heart->clock().cycle_at(within).begin, heart->by_ecg().cycle_at(within).begin);
  heart->forget_r_peaks();
  expect_same(heart->completed(), heart->by_ecg(), frame);
}

// Cycles of one length tell nothing of the law.
TEST_F(Heart, RPeaksStayWhereTheEcgHasThemWhileMoreThanOneLawIsPossible) {
  settings.law_from_image = true;
  rr_scatter_s = 0.0;
  run(45);
  ASSERT_TRUE(heart->by_ecg().law_belief().laws().undecided());
  expect_same(heart->completed(), heart->by_ecg(), frame);
}

TEST_F(Heart, WhatWasWeighedUnderALawIsForgottenWhenAnotherBecomesPossible) {
  settings.law_from_image = true;
  rr_scatter_s = 0.0;
  run(12);
  for (int i = 0; i < 3; ++i) {
    try_laws(20, kLinearExplains);
    run(8);
  }
  ASSERT_FALSE(heart->by_ecg().law_belief().laws().undecided());
  ASSERT_NE(heart->completed().anchor(), heart->by_ecg().anchor());
  for (int i = 0; i < 9 && !change.other_laws; ++i) {
    run(3);
    try_laws(20, kWarpedExplains);
    next_frame();
  }
  EXPECT_TRUE(change.other_laws);
  EXPECT_FALSE(change.another_law) << "it is not told yet";
  EXPECT_TRUE(heart->by_ecg().law_belief().laws().undecided());
  expect_same(heart->completed(), heart->by_ecg(), frame);
}

TEST_F(Heart, GoesOnFromTheLawOfAnEarlierRunUnlessItIsConfigured) {
  settings.law_from_image = true;
  sees = false;
  run(12);
  try_laws(20, kWarpedExplains);
  next_frame();
  const LawMemory memory = heart->law_memory();
  for (const bool from_image : {true, false}) {
    settings.law_from_image = from_image;
    HeartPhase next(settings);
    next.recall(memory);
    static_cast<void>(next.begin_frame(tracker.clock(), frame, frame));
    EXPECT_EQ(next.clock().law().law, from_image ? PhaseLaw::kWarped : PhaseLaw::kLinear);
  }
}

}  // namespace
}  // namespace perimap
