#include "core/phase/cycle_posterior.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"
#include "running_cycle.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using test::Cycle;

TEST_F(Cycle, SaysNothingBeforeAnythingIsObserved) {
  posterior.follow(tracker.clock(), begin + milliseconds(100));
  EXPECT_EQ(posterior.correction().beats, 0U);
}

TEST_F(Cycle, FindsTheLengthFromTheFirstHalf) {
  observe_until(milliseconds(400));
  const CycleCorrection correction = posterior.correction();
  EXPECT_EQ(correction.beats, tracker.clock().beats());
  const double deviation_s = to_seconds(correction.length_deviation);
  EXPECT_LT(deviation_s, 0.3 * to_seconds(tracker.clock().length_deviation()));
  EXPECT_LT(std::abs(length_error_s()), 4.0 * deviation_s);
}

TEST_F(Cycle, FindsTheBeginningToo) {
  // The R peak was detected 4 ms late.
  begin -= milliseconds(4);
  observe_until(milliseconds(600));
  const CycleCorrection correction = posterior.correction();
  EXPECT_NEAR(to_seconds(correction.begin - begin), 0.0, 2.5e-3);
  EXPECT_NEAR(length_error_s(), 0.0, 0.015);
}

// An R peak that was detected late ended the cycle before late as well, whose length sets systole.
TEST_F(Cycle, TheBeginningMovesTheWarpedSystoleWithIt) {
  CardiacClockSettings settings;
  settings.law.law = PhaseLaw::kWarped;
  tracker = CardiacClockTracker(settings);
  std::normal_distribution<double> scatter(0.0, 0.004);
  Instant r_peak;
  for (Instant t = from_ns(5'000'000'000); t < from_ns(15'000'000'000); t += from_seconds(0.49 + scatter(generator))) {
    tracker.on_r_peak({t, t + milliseconds(90), 1.0, milliseconds(6)});
    r_peak = t;
  }
  const Duration late = milliseconds(10);  // two steps of the grid
  const Duration previous = tracker.clock().last_rr() - late;
  const auto truth = [&](Instant t) {
    return phase_in_cycle(settings.law, t - (r_peak - late), tracker.clock().predicted_length(), previous);
  };
  for (Instant t = r_peak + milliseconds(200); t < r_peak + milliseconds(260); t += milliseconds(3)) {
    posterior.follow(tracker.clock(), t);
    posterior.add({t, truth(t).phase_rad, 1e-3 * truth(t).rate_rad_per_s});
  }
  const Instant asked = r_peak + milliseconds(230);
  const PhaseEstimate told = tracker.clock().corrected(posterior.correction()).at(asked);
  EXPECT_NEAR((told.phase_rad - truth(asked).phase_rad) / told.rate_rad_per_s, 0.0, 1e-3);
}

TEST_F(Cycle, WhatWasObservedIsWeighedAnewUnderALawThatIsTakenMeanwhile) {
  const CardiacClock linear = tracker.clock();
  const CardiacClock warped = linear.with_law({.settings = {.law = PhaseLaw::kWarped}, .probabilities = {}});
  CyclePosterior always;
  const Instant taken = begin + milliseconds(400);
  for (Instant t = begin + milliseconds(20); t < taken + milliseconds(100); t += milliseconds(33)) {
    const CyclePhase phase = phase_in_cycle(warped.law(), t - begin, length, linear.last_rr());
    const ObservedPhase seen{t, phase.phase_rad, phase.rate_rad_per_s * kDeviation_s};
    always.follow(warped, t);
    always.add(seen);
    posterior.follow(t < taken ? linear : warped, t);
    posterior.add(seen);
  }
  EXPECT_GT(always.correction().beats, 0U);
  EXPECT_EQ(posterior.correction().begin, always.correction().begin);
  EXPECT_EQ(posterior.correction().length, always.correction().length);
}

TEST_F(Cycle, AWrongObservationOfFiveDoesNotMoveIt) {
  int k = 0;
  for (Duration s = milliseconds(20); s <= milliseconds(600); s += milliseconds(33)) {
    observe(begin + s, ++k % 5 == 0 ? 0.04 : 0.0);
  }
  EXPECT_NEAR(length_error_s(), 0.0, 0.01);
}

TEST_F(Cycle, TheCorrectedClockPredictsThePhaseToCome) {
  observe_until(milliseconds(400));
  const CardiacClock corrected = tracker.clock().corrected(posterior.correction());
  const Instant later = begin + milliseconds(600);
  const PhaseEstimate phase = corrected.at(later);
  EXPECT_EQ(phase.state, PhaseState::kLocked);
  EXPECT_FALSE(phase.contradicted);
  const double error_s = (phase.phase_rad - true_phase(later)) / phase.rate_rad_per_s;
  EXPECT_LT(std::abs(error_s), 0.006);
  EXPECT_LT(std::abs(error_s), 4.0 * phase.deviation_s);
  EXPECT_LT(phase.deviation_s, tracker.clock().at(later).deviation_s);
}

TEST_F(Cycle, ACorrectionOfAnotherCycleChangesNothing) {
  observe_until(milliseconds(400));
  CycleCorrection correction = posterior.correction();
  ++correction.beats;
  const Instant t = begin + milliseconds(500);
  EXPECT_EQ(tracker.clock().corrected(correction).at(t).phase_rad, tracker.clock().at(t).phase_rad);
}

TEST_F(Cycle, TakesWhatWasSeenBeforeTheBeatWasKnownIntoTheNewCycle) {
  observe_until(milliseconds(600));
  // The next R peak comes as it must; it is known 90 ms later, when some frames have already seen the new cycle.
  const Instant next = begin + length;
  const Duration next_length = milliseconds(780);
  for (int ms : {20, 50, 80}) {
    posterior.follow(tracker.clock(), next + milliseconds(ms));
    posterior.add({next + milliseconds(ms), kTwoPi * ms / 780.0, kTwoPi / 0.78 * kDeviation_s});
  }
  tracker.on_r_peak({next, next + milliseconds(90), 1.0, milliseconds(2)});
  posterior.follow(tracker.clock(), next + milliseconds(95));
  const CycleCorrection correction = posterior.correction();
  EXPECT_EQ(correction.beats, tracker.clock().beats());
  EXPECT_NEAR(to_seconds(correction.begin - next), 0.0, 2e-3);
  EXPECT_LT(correction.begin_deviation, milliseconds(2));
  EXPECT_NEAR(to_seconds(correction.length - next_length), 0.0, 0.08);
}

TEST_F(Cycle, PastTheEndItFollowsTheNextCycleThoughItsBeatIsNotKnown) {
  observe_until(length);
  const Instant next = begin + length;
  // A next cycle much shorter than predicted: the phase runs fast.
  for (int ms = 10; ms <= 130; ms += 30) {
    posterior.follow(tracker.clock(), next + milliseconds(ms));
    posterior.add({next + milliseconds(ms), kTwoPi * ms / 740.0, kTwoPi / 0.74 * kDeviation_s});
  }
  const CycleCorrection correction = posterior.correction();
  EXPECT_LT(correction.next_length, milliseconds(790));
  EXPECT_GT(correction.next_length_deviation, Duration::zero());
  const PhaseEstimate phase = tracker.clock().corrected(correction).at(next + milliseconds(140));
  EXPECT_NEAR(phase.phase_rad, kTwoPi * 140.0 / 740.0, 0.05);
}

TEST_F(Cycle, ABeatThatShouldHaveComeMakesTheCycleLonger) {
  observe(begin + milliseconds(20));
  const Duration before = posterior.correction().length;
  // Nothing to be seen since, and no R peak either.
  const Instant due = tracker.clock().predicted_r_peak();
  posterior.follow(tracker.clock(), due + tracker.clock().detector_delay() + milliseconds(20));
  EXPECT_GT(posterior.correction().length, before + milliseconds(15));
}

TEST_F(Cycle, WhatContradictsThePredictionWidensTheDeviationAtOnceAndUntilItIsExplained) {
  observe_until(milliseconds(500));
  const Duration calm = posterior.correction().begin_deviation;
  // A premature beat: the heart is at the beginning of the next cycle.
  const Instant t = begin + milliseconds(540);
  posterior.follow(tracker.clock(), t);
  posterior.add({t, kTwoPi + 0.1, 0.015});
  EXPECT_GT(posterior.correction().begin_deviation, milliseconds(100));
  posterior.follow(tracker.clock(), t + milliseconds(150));
  EXPECT_GT(posterior.correction().begin_deviation, milliseconds(100)) << "with nothing seen since";
  EXPECT_TRUE(tracker.clock().corrected(posterior.correction()).at(t + milliseconds(150)).contradicted);
  // Its R peak is known.
  tracker.on_r_peak({t, t + milliseconds(160), 1.0, milliseconds(2)});
  posterior.follow(tracker.clock(), t + milliseconds(170));
  EXPECT_EQ(posterior.correction().beats, tracker.clock().beats());
  EXPECT_LE(posterior.correction().begin_deviation, std::max(calm, Duration(milliseconds(30))));
}

TEST_F(Cycle, ImagesThatFitNoPhaseWidenTheDeviationUntilOneFits) {
  observe_until(milliseconds(400));
  posterior.add_contradiction();
  EXPECT_GT(posterior.correction().begin_deviation, milliseconds(100));
  observe(begin + milliseconds(450));
  EXPECT_EQ(posterior.correction().beats, tracker.clock().beats());
  EXPECT_LT(posterior.correction().begin_deviation, milliseconds(5));
}

TEST_F(Cycle, ACycleInWhichNothingButContradictionsWereSeenIsWide) {
  posterior.follow(tracker.clock(), begin + milliseconds(100));
  posterior.add_contradiction();
  EXPECT_EQ(posterior.correction().beats, tracker.clock().beats());
  EXPECT_TRUE(posterior.correction().contradicted);
  EXPECT_GT(posterior.correction().begin_deviation, milliseconds(100));
}

TEST_F(Cycle, AFrameFromBeforeTheRPeakThatComesAfterItIsNotOfTheNewCycle) {
  observe_until(milliseconds(300));
  const CycleCorrection before = posterior.correction();
  posterior.add({begin - milliseconds(30), kTwoPi - 0.2, 0.015});
  const CycleCorrection after = posterior.correction();
  EXPECT_EQ(after.length, before.length);
  EXPECT_EQ(after.begin_deviation, before.begin_deviation);
  EXPECT_FALSE(after.contradicted);
}

}  // namespace
}  // namespace perimap
