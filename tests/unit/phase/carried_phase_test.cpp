// The images carry the phase on while the ECG is gone.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/cycle_posterior.hpp"
#include "running_cycle.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using test::Cycle;

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

}  // namespace
}  // namespace perimap
