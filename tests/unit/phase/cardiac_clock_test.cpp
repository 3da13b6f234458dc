#include "core/phase/cardiac_clock.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <random>

#include "core/angle/angle.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
constexpr Duration kPeakDeviation = std::chrono::microseconds(1500);

RPeak peak_at(Instant t) { return {t, t + milliseconds(90), 0.9, kPeakDeviation}; }

// A tracker that has seen `beats` beats 800 ms apart; the last is at `last`.
struct Steady {
  explicit Steady(int beats) {
    for (int i = 0; i < beats; ++i) tracker.on_r_peak(peak_at(first + i * milliseconds(800)));
    last = first + (beats - 1) * milliseconds(800);
  }
  PhaseEstimate at(Instant t) const { return tracker.clock().at(t); }

  CardiacClockTracker tracker{CardiacClockSettings{}};
  Instant first = from_ns(5'000'000'000);
  Instant last;
};

TEST(CardiacClock, IsUnknownBeforeThreeBeats) {
  EXPECT_EQ(Steady(0).at(from_ns(1)).state, PhaseState::kUnknown);
  const Steady two(2);
  EXPECT_EQ(two.at(two.last + milliseconds(100)).state, PhaseState::kUnknown);
  EXPECT_EQ(two.at(two.last + milliseconds(100)).rate_rad_per_s, 0.0);
  EXPECT_EQ(two.at(two.last - milliseconds(100)).state, PhaseState::kUnknown);
  const Steady three(3);
  EXPECT_EQ(three.at(three.last + milliseconds(100)).state, PhaseState::kLocked);
  EXPECT_EQ(three.at(three.last - milliseconds(100)).state, PhaseState::kLocked);
}

TEST(CardiacClock, CurrentCycleIsCausalAndGrowsUncertain) {
  const Steady steady(20);
  double last = 0.0;
  for (int ms = 0; ms < 800; ms += 50) {
    const PhaseEstimate estimate = steady.at(steady.last + milliseconds(ms));
    EXPECT_NEAR(estimate.phase_rad, kTwoPi * ms / 800.0, 1e-6);
    EXPECT_NEAR(estimate.rate_rad_per_s, kTwoPi / 0.8, 1e-6);
    EXPECT_FALSE(estimate.exact);
    EXPECT_GE(estimate.deviation_s, last);
    last = estimate.deviation_s;
  }
  EXPECT_NEAR(steady.at(steady.last).deviation_s, to_seconds(kPeakDeviation), 1e-9);
}

TEST(CardiacClock, CompletedCyclesAreExactAtLeastTwentyFourBack) {
  const Steady steady(200);
  const Instant back = steady.last - 24 * milliseconds(800) + milliseconds(200);
  const PhaseEstimate estimate = steady.at(back);
  EXPECT_TRUE(estimate.exact);
  EXPECT_EQ(estimate.state, PhaseState::kLocked);
  EXPECT_NEAR(estimate.phase_rad, kTwoPi * 0.25, 1e-9);
  EXPECT_LE(estimate.deviation_s, to_seconds(kPeakDeviation));
  EXPECT_EQ(steady.at(steady.first).state, PhaseState::kUnknown);  // long before what is held
}

TEST(CardiacClock, ARPeakThatIsKnownBetterMovesBothItsCyclesAndNoOther) {
  const Steady steady(20);
  const CardiacClock& clock = steady.tracker.clock();
  const std::uint64_t beat = clock.beats() - 4;
  const Instant r_peak = steady.last - 4 * milliseconds(800);
  const CardiacClock moved = clock.with_r_peaks(std::array{MovedRPeak{beat, milliseconds(3), milliseconds(1)}});
  const auto cycle = [&](int after) { return moved.cycle_at(r_peak + after * milliseconds(800) + milliseconds(400)); };
  EXPECT_EQ(cycle(-1).begin, r_peak - milliseconds(800));
  EXPECT_EQ(cycle(-1).length, milliseconds(803));
  EXPECT_EQ(cycle(-1).length_deviation, milliseconds(1));
  EXPECT_EQ(cycle(0).begin, r_peak + milliseconds(3));
  EXPECT_EQ(cycle(0).begin_deviation, milliseconds(1));
  EXPECT_EQ(cycle(0).length, milliseconds(797));
  EXPECT_EQ(cycle(0).previous_length, milliseconds(803));
  EXPECT_EQ(cycle(1).begin, r_peak + milliseconds(800));
  EXPECT_EQ(cycle(1).previous_length, milliseconds(797));
  EXPECT_EQ(cycle(2).previous_length, milliseconds(800));
}

TEST(CardiacClock, RPeaksThatItDoesNotHoldAreNotMoved) {
  const Steady steady(100);
  const CardiacClock& clock = steady.tracker.clock();
  const std::array<MovedRPeak, 3> unknown{
      MovedRPeak{}, {clock.beats() + 1, milliseconds(3), milliseconds(1)}, {10, milliseconds(3), milliseconds(1)}};
  const CardiacClock moved = clock.with_r_peaks(unknown);
  for (int ms = -25'000; ms < 800; ms += 50) {
    const Instant t = steady.last + milliseconds(ms);
    EXPECT_EQ(moved.at(t).phase_rad, clock.at(t).phase_rad);
    EXPECT_EQ(moved.at(t).deviation_s, clock.at(t).deviation_s);
  }
}

TEST(CardiacClock, AnchorsAtThePeaksOwnTimeNotAtItsDetection) {
  const Steady steady(10);
  EXPECT_EQ(steady.tracker.clock().anchor(), steady.last);
  EXPECT_NEAR(steady.at(steady.last + milliseconds(90)).phase_rad, kTwoPi * 90 / 800, 1e-6);
}

TEST(CardiacClock, FreeRunsWithGrowingDeviationThenIsLost) {
  const Steady steady(40);
  const CardiacClock& clock = steady.tracker.clock();
  const Instant due = clock.predicted_r_peak();
  EXPECT_EQ(steady.at(due + milliseconds(20)).state, PhaseState::kLocked);  // the detector may not have had time
  double last = 0.0;
  for (int ms = 1000; ms < 2900; ms += 100) {
    const PhaseEstimate estimate = steady.at(due + milliseconds(ms));
    EXPECT_EQ(estimate.state, PhaseState::kFreeRunning);
    EXPECT_NEAR(std::remainder(estimate.phase_rad - kTwoPi * ms / 800.0, kTwoPi), 0.0, 1e-3);
    EXPECT_GT(estimate.deviation_s, last);
    last = estimate.deviation_s;
  }
  EXPECT_EQ(clock.anchor(), steady.last);
  EXPECT_EQ(steady.at(due + milliseconds(3100)).state, PhaseState::kLost);
  EXPECT_EQ(steady.at(due + milliseconds(3100)).rate_rad_per_s, 0.0);
}

TEST(CardiacClock, CycleWhileFreeRunningBeginsAtAPrediction) {
  const Steady steady(40);
  const CardiacCycle cycle = steady.tracker.clock().cycle_at(steady.last + milliseconds(1900));
  EXPECT_NEAR(to_seconds(cycle.begin - steady.last), 1.6, 1e-3);
  EXPECT_NEAR(to_seconds(cycle.length), 0.8, 1e-3);
  EXPECT_GT(cycle.begin_deviation, kPeakDeviation);
}

TEST(CardiacClock, LocksAgainThreeBeatsAfterALoss) {
  Steady steady(40);
  const Instant back = steady.last + std::chrono::seconds(10);
  steady.tracker.on_r_peak(peak_at(back));
  EXPECT_EQ(steady.at(back + milliseconds(100)).state, PhaseState::kUnknown);
  steady.tracker.on_r_peak(peak_at(back + milliseconds(800)));
  steady.tracker.on_r_peak(peak_at(back + milliseconds(1600)));
  EXPECT_EQ(steady.at(back + milliseconds(1700)).state, PhaseState::kLocked);
  EXPECT_EQ(steady.at(back - milliseconds(100)).state, PhaseState::kLost);
  EXPECT_FALSE(steady.at(back - milliseconds(100)).exact);
  EXPECT_TRUE(steady.at(steady.last - milliseconds(100)).exact);
}

TEST(CardiacClock, RefusesAPeakTooSoonAfterTheLast) {
  Steady steady(10);
  const auto before = steady.tracker.clock().beats();
  steady.tracker.on_r_peak(peak_at(steady.last + milliseconds(240)));
  steady.tracker.on_r_peak(peak_at(steady.last - milliseconds(500)));
  EXPECT_EQ(steady.tracker.clock().beats(), before);
  EXPECT_EQ(steady.tracker.clock().anchor(), steady.last);
}

TEST(CardiacClock, AnEctopicBeatWidensTheDeviationAndHardlyMovesThePrediction) {
  Steady steady(40);
  const Duration calm = steady.tracker.clock().length_deviation();
  const Instant premature = steady.last + milliseconds(500);
  steady.tracker.on_r_peak(peak_at(premature));
  const CardiacClock& clock = steady.tracker.clock();
  EXPECT_EQ(clock.anchor(), premature);
  EXPECT_EQ(clock.last_rr(), milliseconds(500));
  EXPECT_GT(clock.length_deviation(), 2 * calm);
  EXPECT_NEAR(to_seconds(clock.predicted_length()), 0.8, 0.08);
  const PhaseEstimate inside = clock.at(premature - milliseconds(50));
  EXPECT_TRUE(inside.exact);
  EXPECT_GT(inside.deviation_s, 0.1);  // the cycle was cut short, not played faster
}

// Over many beats of a wandering rhythm, the error of the causal phase is what the clock says it is.
TEST(CardiacClock, StatesItsOwnPhaseError) {
  std::mt19937 generator(3);
  std::normal_distribution<double> noise(0.0, 0.02);
  CardiacClockTracker tracker{CardiacClockSettings{}};
  Instant t = from_ns(1'000'000'000);
  double normalised = 0.0;
  int scored = 0;
  for (int i = 0; i < 600; ++i) {
    tracker.on_r_peak(peak_at(t));
    const double rr = 0.85 + 0.03 * std::sin(i * 1.2) + noise(generator);
    if (i > 80) {
      const PhaseEstimate estimate = tracker.clock().at(t + from_seconds(0.75 * rr));
      const double error_s = std::remainder(estimate.phase_rad - 0.75 * kTwoPi, kTwoPi) / estimate.rate_rad_per_s;
      normalised += std::pow(error_s / estimate.deviation_s, 2);
      ++scored;
    }
    t += from_seconds(rr);
  }
  EXPECT_NEAR(normalised / scored, 1.0, 0.25);
}

// Systole lasts as long as the cycle before says, whose ends are measured with errors too: at a fast heart's rate they
// matter as much as those of the cycle's own beginning.
TEST(CardiacClock, StatesThePhaseErrorThatTheCycleBeforeMakesUnderTheWarpedLaw) {
  CardiacClockSettings settings;
  settings.law.law = PhaseLaw::kWarped;
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, 1.0);
  const double peak_s = to_seconds(kPeakDeviation);
  const double shares[] = {0.3, 0.5, 0.7};  // of the cycle: systole is over at 0.6
  double completed[3] = {};
  double running[3] = {};
  double next[3] = {};
  constexpr int kTrials = 3000;
  for (int trial = 0; trial < kTrials; ++trial) {
    CardiacClockTracker tracker(settings);
    double rr_s[34] = {};
    double r_s[35] = {1.0};
    for (int i = 0; i < 34; ++i) {
      rr_s[i] = 0.49 + 0.022 * noise(random);
      r_s[i + 1] = r_s[i] + rr_s[i];
    }
    const auto instant = [](double s) { return Instant(from_seconds(s)); };
    const auto score = [&](const CardiacClock& clock, int cycle, double share) {
      const Seconds since(share * rr_s[cycle]);
      const CyclePhase truth = phase_in_cycle(settings.law, since, Seconds(rr_s[cycle]), Seconds(rr_s[cycle - 1]));
      const PhaseEstimate told = clock.at(instant(r_s[cycle] + since.count()));
      const double error_rad = std::remainder(told.phase_rad - truth.phase_rad, kTwoPi);
      return std::pow(error_rad / (told.rate_rad_per_s * told.deviation_s), 2) / kTrials;
    };
    for (int i = 0; i <= 32; ++i) tracker.on_r_peak(peak_at(instant(r_s[i] + peak_s * noise(random))));
    for (int k = 0; k < 3; ++k) {
      completed[k] += score(tracker.clock(), 31, shares[k]);
      running[k] += score(tracker.clock(), 32, shares[k]);
      next[k] += score(tracker.clock(), 33, shares[k]);
    }
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(completed[k], 1.0, 0.15) << shares[k];
    EXPECT_NEAR(running[k], 1.0, 0.25) << shares[k];
    // Errors of a whole prediction reach over the end of systole, where the rate is another.
    if (shares[k] < 0.6) {
      EXPECT_NEAR(next[k], 1.0, 0.25) << shares[k];
    }
  }
}

TEST(CardiacClock, AnEcgThatIsGoneIsSaidAtOnce) {
  Steady steady(40);
  const Instant now = steady.last + milliseconds(200);
  steady.tracker.heard(now);
  EXPECT_EQ(steady.tracker.clock().as_of(now + milliseconds(50)).at(now).state, PhaseState::kLocked);
  EXPECT_EQ(steady.tracker.clock().as_of(now + milliseconds(300)).at(now).state, PhaseState::kFreeRunning) << "silence";
  steady.tracker.interrupt();
  EXPECT_EQ(steady.tracker.clock().as_of(now).at(now).state, PhaseState::kFreeRunning) << "lead off";
  steady.tracker.heard(now);
  EXPECT_EQ(steady.tracker.clock().as_of(now).at(now).state, PhaseState::kLocked);
}

// One beat in thirty comes early, and nobody hears the last three cycles.
TEST(CardiacClock, TheDeviationOfCyclesThatNobodyHeardCountsPrematureBeats) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0.8, 0.02);
  std::uniform_real_distribution<double> even(0.0, 1.0);
  double normalised = 0.0;
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    CardiacClockTracker tracker{CardiacClockSettings{}};
    Instant t = from_ns(1'000'000'000);
    const auto next = [&](BeatClass& beat_class) {
      const bool premature = even(random) < 1.0 / 30.0;
      beat_class = premature ? BeatClass::kPremature : BeatClass::kNormal;
      t += from_seconds((premature ? 0.7 : 1.0) * normal(random));
    };
    BeatClass beat_class = BeatClass::kNormal;
    for (int i = 0; i < 80; ++i) {
      next(beat_class);
      RPeak peak = peak_at(t);
      peak.beat_class = i < 79 ? beat_class : BeatClass::kNormal;
      tracker.on_r_peak(peak);
    }
    tracker.heard(t);
    tracker.interrupt();
    for (int i = 0; i < 3; ++i) next(beat_class);
    const PhaseEstimate estimate = tracker.clock().as_of(t).at(t);
    ASSERT_EQ(estimate.state, PhaseState::kFreeRunning);
    const double error_s = std::remainder(estimate.phase_rad, kTwoPi) / estimate.rate_rad_per_s;
    normalised += std::pow(error_s / estimate.deviation_s, 2);
  }
  EXPECT_GT(normalised / kTrials, 0.5);
  EXPECT_LT(normalised / kTrials, 1.5);
}

TEST(CardiacClock, WhatAnInterruptionMayHaveHiddenTeachesNothing) {
  Steady steady(40);
  const Duration before = steady.tracker.clock().predicted_length();
  steady.tracker.interrupt();
  const Instant back = steady.last + milliseconds(1500);  // a beat was missed
  for (int i = 0; i < 3; ++i) steady.tracker.on_r_peak(peak_at(back + i * milliseconds(800)));
  EXPECT_EQ(steady.at(back - milliseconds(100)).state, PhaseState::kLost);
  EXPECT_FALSE(steady.at(back - milliseconds(100)).teaches);
  EXPECT_TRUE(steady.at(back + milliseconds(100)).teaches);
  EXPECT_NEAR(to_seconds(steady.tracker.clock().predicted_length()), to_seconds(before), 0.005);
}

TEST(CardiacClock, AfterAnInterruptionTheFirstBeatGivesThePhaseAndTheThirdLocksIt) {
  Steady steady(40);
  steady.tracker.interrupt();
  const Instant back = steady.last + milliseconds(1500);
  for (int i = 0; i < 3; ++i) {
    const Instant beat = back + i * milliseconds(800);
    steady.tracker.on_r_peak(peak_at(beat));
    steady.tracker.heard(beat + milliseconds(100));
    EXPECT_EQ(steady.at(beat + milliseconds(100)).state, i < 2 ? PhaseState::kFreeRunning : PhaseState::kLocked) << i;
  }
  steady.tracker.interrupt();
  steady.tracker.on_r_peak(peak_at(back + std::chrono::seconds(20)));
  steady.tracker.heard(back + std::chrono::seconds(20));
  EXPECT_EQ(steady.at(back + std::chrono::seconds(20)).state, PhaseState::kUnknown) << "after a loss";
}

// Nothing is known of the cycle before it: that it was as long as predicted, no more.
TEST(CardiacClock, AfterAnInterruptionTheFirstBeatsSystoleIsThatOfThePredictedLength) {
  CardiacClockSettings settings;
  settings.law.law = PhaseLaw::kWarped;
  CardiacClockTracker tracker(settings);
  Instant t = from_ns(5'000'000'000);
  for (int i = 0; i < 40; ++i, t += milliseconds(800)) tracker.on_r_peak(peak_at(t));
  tracker.interrupt();
  const Instant back = t + milliseconds(700);
  tracker.on_r_peak(peak_at(back));
  tracker.heard(back + milliseconds(200));
  const PhaseEstimate phase = tracker.clock().at(back + milliseconds(200));
  ASSERT_EQ(phase.state, PhaseState::kFreeRunning);
  const double expected =
      phase_in_cycle(settings.law, Seconds(0.2), tracker.clock().predicted_length(), Seconds(0.8)).phase_rad;
  EXPECT_NEAR(phase.phase_rad, expected, 1e-2);
  EXPECT_GT(phase.deviation_s, to_seconds(kPeakDeviation));
}

TEST(CardiacClock, AShortInterruptionWithinACycleKeepsTheRhythmButTeachesNothing) {
  Steady steady(40);
  steady.tracker.interrupt();
  steady.tracker.on_r_peak(peak_at(steady.last + milliseconds(810)));
  steady.tracker.heard(steady.last + milliseconds(900));
  EXPECT_EQ(steady.at(steady.last + milliseconds(900)).state, PhaseState::kLocked);
  EXPECT_TRUE(steady.at(steady.last + milliseconds(400)).exact);
  EXPECT_FALSE(steady.at(steady.last + milliseconds(400)).teaches);
}

// Normal and premature beats in turn, or two normal ones to a premature one.
struct Ectopic {
  explicit Ectopic(int normal_to_one) {
    Steady steady(40);
    tracker = steady.tracker;
    last = steady.last;
    for (int i = 0; i < 24; ++i) {
      const bool premature = i % (normal_to_one + 1) == 0;
      const bool after = i % (normal_to_one + 1) == 1 % (normal_to_one + 1) && i > 0;
      before_last = last;
      last += milliseconds(premature ? 500 : after ? 1100 : 800);
      RPeak peak = peak_at(last);
      if (premature) peak.beat_class = BeatClass::kPremature;
      tracker.on_r_peak(peak);
    }
  }
  CardiacClockTracker tracker{CardiacClockSettings{}};
  Instant last, before_last;
};

TEST(CardiacClock, CyclesWithEctopicBeatsTeachNothingWhileThereAreOthers) {
  const Ectopic trigeminy(2);
  const CardiacClock& clock = trigeminy.tracker.clock();
  EXPECT_NE(clock.rhythm(), Rhythm::kEctopic);
  // The last three cycles: to a premature beat, after it, between two normal ones.
  EXPECT_TRUE(clock.at(trigeminy.last - milliseconds(100)).teaches);
  EXPECT_FALSE(clock.at(trigeminy.before_last - milliseconds(100)).teaches);
  EXPECT_FALSE(clock.at(trigeminy.before_last - milliseconds(1200)).teaches);
}

TEST(CardiacClock, WhereEctopicBeatsPrevailItIsSaidAndCyclesThatBeginNormallyTeach) {
  const Ectopic bigeminy(1);
  const CardiacClock& clock = bigeminy.tracker.clock();
  EXPECT_EQ(clock.rhythm(), Rhythm::kEctopic);
  EXPECT_FALSE(clock.at(bigeminy.last - milliseconds(100)).teaches);
  EXPECT_TRUE(clock.at(bigeminy.before_last - milliseconds(100)).teaches);
  EXPECT_NEAR(to_seconds(clock.predicted_length()), 0.8, 0.05) << "the next premature beat is not predicted";
}

TEST(CardiacClock, SaysWhenTheRhythmIsUnpredictable) {
  std::mt19937 generator(8);
  std::uniform_real_distribution<double> rr_s(0.4, 1.2);
  CardiacClockTracker fibrillation{CardiacClockSettings{}};
  CardiacClockTracker sinus{CardiacClockSettings{}};
  Instant random = from_ns(5'000'000'000);
  Instant even = random;
  for (int i = 0; i < 60; ++i) {
    fibrillation.on_r_peak(peak_at(random += from_seconds(rr_s(generator))));
    sinus.on_r_peak(peak_at(even += milliseconds(800 + i % 3)));
  }
  EXPECT_EQ(fibrillation.clock().rhythm(), Rhythm::kUnpredictable);
  EXPECT_EQ(sinus.clock().rhythm(), Rhythm::kPredictable);
}

TEST(CardiacClock, AfterAPrematureBeatAPauseIsExpectedAndTheCycleIsCalledEctopic) {
  Steady steady(40);
  RPeak premature = peak_at(steady.last + milliseconds(500));
  premature.beat_class = BeatClass::kPremature;
  steady.tracker.on_r_peak(premature);
  const CardiacClock& clock = steady.tracker.clock();
  EXPECT_NEAR(to_seconds(clock.predicted_length()), 1.1, 0.02);
  EXPECT_GT(clock.length_deviation(), milliseconds(100));
  EXPECT_TRUE(clock.at(premature.time + milliseconds(100)).ectopic);
  steady.tracker.on_r_peak(peak_at(premature.time + milliseconds(1090)));
  EXPECT_FALSE(clock.at(premature.time + milliseconds(1200)).ectopic);
}

}  // namespace
}  // namespace perimap
