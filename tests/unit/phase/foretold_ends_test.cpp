// The end of a cycle that the images foretell, and how far it is believed.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/cycle_posterior.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

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
