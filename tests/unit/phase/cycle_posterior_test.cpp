#include "core/phase/cycle_posterior.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

// Twenty beats 800 ms apart within some milliseconds, so that the next length is predicted with a few percent. The
// cycle after them truly begins at `begin` and lasts `length`; the heart runs evenly from R peak to R peak.
struct Cycle : ::testing::Test {
  CardiacClockTracker tracker{CardiacClockSettings{}};
  CyclePosterior posterior;
  std::mt19937 generator{7};
  Instant begin;
  Duration length = milliseconds(830);
  static constexpr double kDeviation_s = 2e-3;

  Cycle() { beat({}); }

  void beat(const CardiacClockSettings& settings) {
    tracker = CardiacClockTracker(settings);
    std::normal_distribution<double> scatter(0.0, 0.03);
    Instant t = from_ns(5'000'000'000);
    for (int i = 0; i < 20; ++i) {
      tracker.on_r_peak({t, t + milliseconds(90), 1.0, milliseconds(2)});
      begin = t;
      t += from_seconds(0.8 + scatter(generator));
    }
  }

  [[nodiscard]] double true_phase(Instant t) const { return kTwoPi * to_seconds(t - begin) / to_seconds(length); }

  void observe(Instant t, double wrong_by_s = 0.0) {
    std::normal_distribution<double> noise(0.0, kDeviation_s);
    const double rate = kTwoPi / to_seconds(length);
    posterior.follow(tracker.clock(), t);
    posterior.add({t, true_phase(t) + rate * (noise(generator) + wrong_by_s), rate * kDeviation_s});
  }
  void observe_until(Duration since_begin) {
    for (Duration s = milliseconds(20); s <= since_begin; s += milliseconds(33)) observe(begin + s);
  }
  [[nodiscard]] double length_error_s() const { return to_seconds(posterior.correction().length - length); }
};

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

// Three cycles of which the ECG tells nothing any more: the images go on showing them.
struct Carried : Cycle {
  Instant gone;
  Duration first_previous = tracker.clock().last_rr();
  std::vector<Duration> lengths{milliseconds(830), milliseconds(790), milliseconds(860), milliseconds(900)};

  // Phase of the heart at t, from `begin` on.
  [[nodiscard]] double phase_at(Instant t) const {
    Instant start = begin;
    std::size_t i = 0;
    Duration previous = first_previous;
    while (t >= start + lengths[i]) {
      previous = lengths[i];
      start += lengths[i++];
    }
    return phase_in_cycle(tracker.clock().law(), t - start, lengths[i], previous).phase_rad;
  }
  CardiacClock ecg(Instant t) {
    if (t > gone) tracker.interrupt();
    return tracker.clock().as_of(t);
  }
  void watch(Instant from, Instant to) {
    std::normal_distribution<double> noise(0.0, kDeviation_s);
    for (Instant t = from; t < to; t += milliseconds(33)) {
      posterior.follow(ecg(t), t);
      posterior.add({t, phase_at(t) + 7.5 * noise(generator), 7.5 * kDeviation_s});
    }
  }
};

TEST_F(Carried, TheImagesCarryThePhaseOnWhenTheEcgIsGoneAndSaySo) {
  gone = begin + milliseconds(300);
  const Instant now = begin + milliseconds(2900);
  watch(begin + milliseconds(20), now);
  const CycleCorrection correction = posterior.correction();
  EXPECT_TRUE(correction.carried);
  const PhaseEstimate phase = ecg(now).corrected(correction).at(now + milliseconds(50));
  EXPECT_EQ(phase.state, PhaseState::kFromImage);
  const double error_s =
      std::remainder(phase.phase_rad - phase_at(now + milliseconds(50)), kTwoPi) / phase.rate_rad_per_s;
  EXPECT_LT(std::abs(error_s), 0.012);
  EXPECT_LT(std::abs(error_s), 4.0 * phase.deviation_s);
  EXPECT_EQ(ecg(now).at(now).state, PhaseState::kFreeRunning) << "the ECG alone";
}

// Systole is as long as the cycle before says, and that is no time between R peaks any more.
struct CarriedAndWarped : Carried {
  int scored = 0;

  CarriedAndWarped() {
    CardiacClockSettings settings;
    settings.law.law = PhaseLaw::kWarped;
    beat(settings);
    gone = begin + milliseconds(100);
    first_previous = tracker.clock().last_rr();
  }

  // Watches on and asks at each frame for the phase so long before it, where the images carry it.
  void expect_the_phase(Duration from, Duration to, const std::vector<Duration>& pasts) {
    for (Instant now = begin + from; now < begin + to; now += milliseconds(33)) {
      watch(now, now + milliseconds(1));
      const CycleCorrection correction = posterior.correction();
      if (!correction.carried) continue;
      const CardiacClock clock = ecg(now).corrected(correction);
      for (const Duration past : pasts) {
        SCOPED_TRACE(to_seconds(now - begin));
        const PhaseEstimate phase = clock.at(now - past);
        // The images' cycle before last is not kept.
        if (phase.state == PhaseState::kLost) continue;
        const double error_s = std::remainder(phase.phase_rad - phase_at(now - past), kTwoPi) / phase.rate_rad_per_s;
        EXPECT_LT(std::abs(error_s), 0.02);
        EXPECT_LT(std::abs(error_s), 4.5 * phase.deviation_s);
        if (now - past > gone) {
          EXPECT_FALSE(phase.exact);
          EXPECT_EQ(phase.state, PhaseState::kFromImage);
        }
        ++scored;
      }
    }
  }
};

TEST_F(CarriedAndWarped, EveryCycleHasItsSystole) {
  expect_the_phase(milliseconds(20), milliseconds(2900), {milliseconds(0), milliseconds(60)});
  EXPECT_GT(scored, 120);
}

TEST_F(CarriedAndWarped, TheCycleBeforeIsNotCalledCompleted) {
  expect_the_phase(milliseconds(20), milliseconds(1200), {milliseconds(0)});
  expect_the_phase(milliseconds(1200), milliseconds(2900), {milliseconds(800)});
  EXPECT_GT(scored, 60);
}

// What comes is no beat of the rhythm: it may be the device coming back, and the images know better.
TEST_F(CarriedAndWarped, ABeatThatDoesNotLockAgainDoesNotMoveWhatTheImagesShow) {
  Duration next = milliseconds(20);
  for (const int ms : {500, 1250, 2100}) {
    expect_the_phase(next, milliseconds(ms), {milliseconds(0)});
    const Instant t = begin + milliseconds(ms);
    tracker.on_r_peak({t, t, 1.0, milliseconds(2)});
    next = milliseconds(ms);
  }
  expect_the_phase(next, milliseconds(2900), {milliseconds(0)});
  EXPECT_GT(scored, 60);
}

TEST_F(Carried, WithoutImagesTheDeviationGrowsAndThenThereIsNoPhase) {
  gone = begin + milliseconds(300);
  const Instant last = begin + milliseconds(1000);
  watch(begin + milliseconds(20), last);
  Duration deviation(0);
  for (int ms = 700; ms < 2900; ms += 100) {
    const Instant now = last + milliseconds(ms);
    posterior.follow(ecg(now), now);
    const PhaseEstimate phase = ecg(now).corrected(posterior.correction()).at(now);
    EXPECT_EQ(phase.state, PhaseState::kFreeRunning);
    deviation = std::max(deviation, from_seconds(phase.deviation_s));
  }
  EXPECT_GT(deviation, milliseconds(30));
  posterior.follow(ecg(last + milliseconds(3100)), last + milliseconds(3100));
  EXPECT_EQ(posterior.correction().beats, 0U);
}

TEST_F(Carried, TheEcgTakesOverWhenItIsThereAgain) {
  gone = begin + milliseconds(300);
  const Instant back = begin + lengths[0] + lengths[1] + lengths[2];
  watch(begin + milliseconds(20), back + milliseconds(90));
  for (int i = 0; i < 3; ++i) tracker.on_r_peak({back + i * milliseconds(850), back, 1.0, milliseconds(2)});
  const Instant now = back + milliseconds(1750);
  tracker.heard(now);
  posterior.follow(tracker.clock().as_of(now), now);
  EXPECT_FALSE(posterior.correction().carried);
  EXPECT_EQ(tracker.clock().as_of(now).corrected(posterior.correction()).at(now).state, PhaseState::kLocked);
}

// A heart in an even rhythm. Until some part of a cycle the images show one that would end at some instant; then
// nothing is seen, and the R peak comes at another. `alone` sees the same and has nothing to go by but this cycle.
struct Heart {
  PhaseLaw law;
  double rr_s;
  double seen;  // of the cycle: the phase depends on its length with a sensitivity of 0.6 to 0.8 there
};

struct ForetoldEnds : ::testing::TestWithParam<Heart> {
  static constexpr double kDeviation_s = 0.3e-3;
  static constexpr Duration kFrame = milliseconds(16);

  CardiacClockSettings settings;
  CardiacClockTracker tracker{settings};
  CyclePosterior posterior;
  CyclePosterior alone;
  std::mt19937 generator{11};
  Instant begin = from_ns(5'000'000'000);
  double previous_s = GetParam().rr_s;
  double moved_square = 0.0;  // of the ends by `alone` and, summed with them, by `posterior`
  double product = 0.0;

  ForetoldEnds() {
    settings.law.law = GetParam().law;
    restart(settings.law.law);
  }

  void restart(PhaseLaw law) {
    settings.law.law = law;
    tracker = CardiacClockTracker(settings);
    for (int i = 0; i < 20; ++i) next_beat(GetParam().rr_s + scatter(3e-3));
  }

  double scatter(double deviation_s) { return std::normal_distribution<double>(0.0, deviation_s)(generator); }

  void next_beat(double length_s, BeatClass beat_class = BeatClass::kNormal) {
    begin += from_seconds(length_s);
    previous_s = length_s;
    tracker.on_r_peak({begin, begin + milliseconds(90), 1.0, milliseconds(2), beat_class});
  }

  void look(Instant t, double shown_s) {
    const CyclePhase shown = phase_in_cycle(settings.law, t - begin, Seconds(shown_s), Seconds(previous_s));
    for (CyclePosterior* each : {&posterior, &alone}) {
      each->follow(tracker.clock(), t);
      each->add({t, shown.phase_rad, kDeviation_s * shown.rate_rad_per_s});
    }
  }
  // Returns the instant looked at last.
  Instant look_until(double share, double shown_s) {
    alone = CyclePosterior();
    return look_on(begin + milliseconds(100), share, shown_s);
  }
  Instant look_on(Instant t, double share, double shown_s) {
    for (; to_seconds(t - begin) < share * shown_s; t += kFrame) look(t, shown_s);
    return t - kFrame;
  }
  // The ends by both, after that of the ECG.
  [[nodiscard]] static double end_s(const CycleCorrection& of, Instant predicted) {
    return to_seconds(of.begin + of.length - predicted);
  }
  // Beats that scatter so much; the images show their true lengths, or others that have nothing to do with them.
  void cycles(int n, double beats_s, double images_s = 0.0) {
    moved_square = product = 0.0;
    for (int i = 0; i < n; ++i) {
      const double length_s = GetParam().rr_s + scatter(beats_s);
      look_until(GetParam().seen, images_s > 0.0 ? GetParam().rr_s + scatter(images_s) : length_s);
      const double by_images_s = end_s(alone.correction(), tracker.clock().predicted_r_peak());
      moved_square += by_images_s * by_images_s;
      product += by_images_s * end_s(posterior.correction(), tracker.clock().predicted_r_peak());
      next_beat(length_s);
    }
  }
  [[nodiscard]] double weight() const { return product / moved_square; }
  void learn_that_the_images_are_wrong() { cycles(80, 0.003, 0.01 * GetParam().rr_s); }
};

TEST_P(ForetoldEnds, ThatWereRightAreBelieved) {
  cycles(60, 0.02);
  cycles(20, 0.02);
  EXPECT_NEAR(weight(), 1.0, 0.1);
  EXPECT_GT(moved_square, 20 * 0.005 * 0.005);
}

TEST_P(ForetoldEnds, ThatWereWrongCountLittleAndThePhaseSeenLastStays) {
  learn_that_the_images_are_wrong();
  cycles(20, 0.003, 0.01 * GetParam().rr_s);
  EXPECT_LT(weight(), 0.35);
  EXPECT_GT(moved_square, 20 * 0.003 * 0.003);
  const double shown_s = 1.01 * GetParam().rr_s;
  for (Instant t = look_until(0.4, shown_s); to_seconds(t - begin) < GetParam().seen * shown_s; t += kFrame) {
    look(t, shown_s);
    const PhaseEstimate seen = tracker.clock().corrected(alone.correction()).at(t);
    const PhaseEstimate phase = tracker.clock().corrected(posterior.correction()).at(t);
    EXPECT_NEAR(phase.phase_rad, seen.phase_rad, 1e-6);
    EXPECT_GE(phase.deviation_s, 0.999 * seen.deviation_s);
    EXPECT_LT(phase.deviation_s,
              tracker.clock().at(t).deviation_s + std::abs(to_seconds(posterior.correction().given_way)));
  }
}

TEST_P(ForetoldEnds, ThatCountLittleHaveTheDeviationOfThePrediction) {
  learn_that_the_images_are_wrong();
  look_until(GetParam().seen, to_seconds(tracker.clock().predicted_length()));
  const CardiacClock clock = tracker.clock().corrected(posterior.correction());
  EXPECT_GT(clock.predicted_r_peak_deviation(), 0.8 * tracker.clock().predicted_r_peak_deviation());
}

TEST_P(ForetoldEnds, ThatCountLittleLeaveTheRPeakWhereItIs) {
  learn_that_the_images_are_wrong();
  const Instant r_peak = begin;
  look_until(GetParam().seen, 1.01 * GetParam().rr_s);
  const CycleCorrection correction = posterior.correction();
  ASSERT_GT(std::abs(correction.given_way.count()), 100'000);
  const CardiacClock clock = tracker.clock().corrected(correction);
  EXPECT_EQ(clock.anchor(), correction.begin - correction.given_way);
  EXPECT_NEAR(to_seconds(clock.anchor() - r_peak), 0.0, 2e-3);
  EXPECT_EQ(clock.predicted_r_peak(), correction.begin + correction.length);
  // The cycles abut, and what begins or ends there is as uncertain as that has become wrong.
  const CardiacCycle before = clock.cycle_at(correction.begin - Duration(1));
  EXPECT_TRUE(before.completed);
  EXPECT_EQ(before.begin + before.length, correction.begin);
  EXPECT_GE(before.length_deviation, std::chrono::abs(correction.given_way));
  EXPECT_EQ(clock.cycle_at(correction.begin).begin, correction.begin);
  EXPECT_GE(clock.cycle_at(correction.begin).begin_deviation, std::chrono::abs(correction.given_way));
}

TEST_P(ForetoldEnds, AreNotBeforeWhatTheDetectorHasHeard) {
  learn_that_the_images_are_wrong();
  const Instant seen = look_until(GetParam().seen, 1.012 * GetParam().rr_s);
  const CardiacClock ecg = tracker.clock();
  const Instant due = ecg.predicted_r_peak();
  ASSERT_LT(end_s(posterior.correction(), due), 0.5 * end_s(alone.correction(), due));
  double before_s = end_s(posterior.correction(), due);
  int past_due = 0;
  for (Instant now = seen; ecg.at(now).state == PhaseState::kLocked; now += milliseconds(2)) {
    posterior.follow(ecg, now);
    alone.follow(ecg, now);
    const double by_all_s = end_s(posterior.correction(), due);
    const double heard_s = to_seconds(now - ecg.detector_delay() - due);
    EXPECT_GE(by_all_s, std::min(end_s(alone.correction(), due), heard_s) - 1e-6);
    EXPECT_LT(std::abs(by_all_s - before_s), 0.003) << "steadily, at " << heard_s;
    before_s = by_all_s;
    if (heard_s > 0.005) ++past_due;
  }
  EXPECT_GT(past_due, 0);
}

TEST_P(ForetoldEnds, StayWhereTheyAreWhenTheLeadComesOff) {
  learn_that_the_images_are_wrong();
  const Instant now = look_until(GetParam().seen, 1.01 * GetParam().rr_s) + milliseconds(1);
  posterior.follow(tracker.clock(), now);
  const Instant end = posterior.correction().begin + posterior.correction().length;
  tracker.interrupt();
  posterior.follow(tracker.clock(), now);
  ASSERT_TRUE(posterior.correction().carried);
  EXPECT_EQ(posterior.correction().begin + posterior.correction().length, end);
}

TEST_P(ForetoldEnds, DoNotFallBehindWhatWasHeardWhenTheBeatStaysAway) {
  learn_that_the_images_are_wrong();
  Instant now = look_until(GetParam().seen, 1.012 * GetParam().rr_s);
  const CardiacClock ecg = tracker.clock();
  for (; ecg.at(now).state == PhaseState::kLocked; now += milliseconds(1)) posterior.follow(ecg, now);
  posterior.follow(ecg, now);
  const CycleCorrection correction = posterior.correction();
  ASSERT_TRUE(correction.carried);
  alone.follow(ecg, now);
  const Instant by_images = alone.correction().begin + alone.correction().length;
  EXPECT_GE(correction.begin + correction.length,
            std::min(now - ecg.detector_delay(), by_images) - std::chrono::microseconds(10));
}

TEST_P(ForetoldEnds, ForWhichNoBeginningIsFoundAreAsUncertainAsTheyAreOff) {
  learn_that_the_images_are_wrong();
  look_until(GetParam().seen, 1.04 * GetParam().rr_s);
  const CardiacClock clock = tracker.clock().corrected(posterior.correction());
  const double off_s = to_seconds(clock.predicted_r_peak() - tracker.clock().predicted_r_peak());
  EXPECT_GT(clock.predicted_r_peak_deviation(), tracker.clock().predicted_r_peak_deviation());
  EXPECT_LT(off_s, 2.5 * to_seconds(clock.predicted_r_peak_deviation()));
}

// The pause is predicted as a full compensatory one, and not well; the images see it.
TEST_P(ForetoldEnds, AreBelievedInThePauseAfterAPrematureBeat) {
  learn_that_the_images_are_wrong();
  look_until(GetParam().seen, GetParam().rr_s);
  next_beat(0.7 * GetParam().rr_s, BeatClass::kPremature);
  const Instant due = tracker.clock().predicted_r_peak();
  look_until(GetParam().seen, to_seconds(due - begin) + 0.04);
  EXPECT_NEAR(end_s(posterior.correction(), due), end_s(alone.correction(), due), 0.006);
  EXPECT_GT(end_s(alone.correction(), due), 0.025);
}

TEST_P(ForetoldEnds, OfCyclesThatTeachNothingDoNotCount) {
  cycles(30, 0.003);
  for (int i = 0; i < 20; ++i) {
    look_until(GetParam().seen, to_seconds(tracker.clock().predicted_length()) + scatter(0.01));
    next_beat(0.75 * GetParam().rr_s, BeatClass::kPremature);
    look_until(GetParam().seen, to_seconds(tracker.clock().predicted_length()) + scatter(0.01));
    next_beat(1.25 * GetParam().rr_s);
    for (int k = 0; k < 4; ++k) next_beat(GetParam().rr_s);
  }
  cycles(3, 0.003);
  EXPECT_NEAR(weight(), 1.0, 0.1);
}

TEST_P(ForetoldEnds, OfACycleWhoseBeatsCameTwoAtOnceAreNotHeldAgainstTheNext) {
  cycles(30, 0.003);
  for (int i = 0; i < 20; ++i) {
    look_until(GetParam().seen, 0.985 * GetParam().rr_s);
    next_beat(GetParam().rr_s);
    next_beat(GetParam().rr_s);
    cycles(1, 0.003);
  }
  cycles(3, 0.003);
  EXPECT_NEAR(weight(), 1.0, 0.1);
}

TEST_P(ForetoldEnds, LeaveNoTraceInTheCyclesThatTheImagesCarryOn) {
  learn_that_the_images_are_wrong();
  const Instant r_peak = begin;
  Instant now = look_until(GetParam().seen, 1.01 * GetParam().rr_s);
  tracker.interrupt();
  for (; posterior.correction().ahead == 0; now += milliseconds(10)) posterior.follow(tracker.clock().as_of(now), now);
  const CycleCorrection correction = posterior.correction();
  EXPECT_NEAR(to_seconds(correction.begin - correction.previous_length - r_peak), 0.0, 2e-3);
  EXPECT_EQ(correction.given_way, Duration(0));
}

TEST_P(ForetoldEnds, AreTrustedByWhatTheyWereWorthUnderTheirLaw) {
  learn_that_the_images_are_wrong();
  const PhaseLaw law = settings.law.law;
  restart(law == PhaseLaw::kLinear ? PhaseLaw::kWarped : PhaseLaw::kLinear);
  cycles(3, 0.003);
  EXPECT_NEAR(weight(), 1.0, 0.1);
  restart(law);
  cycles(3, 0.003, 0.01 * GetParam().rr_s);
  EXPECT_LT(weight(), 0.5);
}

INSTANTIATE_TEST_SUITE_P(Hearts, ForetoldEnds,
                         ::testing::Values(Heart{PhaseLaw::kLinear, 0.83, 0.65}, Heart{PhaseLaw::kLinear, 0.49, 0.65},
                                           Heart{PhaseLaw::kWarped, 0.83, 0.82}, Heart{PhaseLaw::kWarped, 0.49, 0.85},
                                           Heart{PhaseLaw::kTimeLocked, 0.83, 0.79},
                                           Heart{PhaseLaw::kTimeLocked, 0.49, 0.65}));

}  // namespace
}  // namespace perimap
