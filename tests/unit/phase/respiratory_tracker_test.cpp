#include "core/phase/respiratory_tracker.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

#include "breathing_patient.hpp"
#include "core/angle/angle.hpp"

namespace perimap {
namespace {

using Eigen::Vector3d;
using test::at_s;
using test::Patient;
using test::Tracking;
using test::watch;

TEST_F(Tracking, UntilTheBreathIsKnownItsDisplacementIsReckonedWith) {
  RespiratoryTracker tracker(settings);
  EXPECT_EQ(tracker.clock().state, RespirationState::kSearching);
  EXPECT_FALSE(tracker.clock().at(at_s(1.0)).known);
  EXPECT_EQ(tracker.clock().at(at_s(1.0)).deviation_mm, settings.displacement_mm);
  ASSERT_TRUE(lock(tracker));
  EXPECT_LT(now_s, 20.0);
  EXPECT_TRUE(tracker.clock().at(at_s(now_s)).known);
  EXPECT_LT(tracker.clock().at(at_s(now_s)).deviation_mm, 0.5);
  EXPECT_NEAR(to_seconds(tracker.clock().period()), 4.0, 0.1);
  for (double t = now_s; t < now_s + 4.0; t += 0.2) EXPECT_LT((predicted(tracker, t) - truth(t)).norm(), 1.0) << t;
}

// An irregular heart moves the map's displacement by as much as breathing does, at no period of its own.
TEST_F(Tracking, APeriodThatStaysIsFoundThoughMuchElseMovesTheSurface) {
  patient.noise_mm = 4.0;
  RespiratoryTracker tracker(settings);
  ASSERT_TRUE(lock(tracker));
  EXPECT_LE(now_s, 45.0);
  EXPECT_NEAR(to_seconds(tracker.clock().period()), patient.period_s, 0.02 * patient.period_s);
}

TEST_F(Tracking, APeriodThatDoesNotStayIsNoBreath) {
  patient.noise_mm = 4.0;
  RespiratoryTracker tracker(settings);
  for (; now_s < 60.0; now_s += 1.0) {
    // Slower by 4 % in ten seconds, without a jump.
    const double slower = 1.004;
    patient.begin_s = now_s - slower * (now_s - patient.begin_s);
    patient.period_s *= slower;
    watch(tracker, patient, now_s, now_s + 1.0);
    tracker.search(at_s(now_s + 1.0));
    ASSERT_NE(tracker.clock().state, RespirationState::kLocked) << now_s;
  }
}

TEST_F(Tracking, AMapThatLearnsTheFirstBreathByTheClockDoesNotConfirmIt) {
  RespiratoryTracker tracker(settings);
  ASSERT_TRUE(lock(tracker));
  const RespiratoryClock at_lock = tracker.clock();
  const double period_s = to_seconds(at_lock.period());
  const double phase = at_lock.at(at_s(now_s)).phase_rad;
  const auto show = [&](double since_s) {
    tracker.add_phase(at_s(now_s + since_s), phase + 0.1 + at_lock.rate_rad_per_s * since_s, 0.01);
  };
  for (double since_s = 0.0; since_s < period_s - 0.05; since_s += 0.04) show(since_s);
  EXPECT_TRUE(tracker.clock().doubtful());
  EXPECT_EQ(tracker.clock().rate_rad_per_s, at_lock.rate_rad_per_s);
  EXPECT_GE(tracker.clock().rate_variance_rad2_per_s2, at_lock.rate_variance_rad2_per_s2);
  for (double since_s = period_s; since_s < period_s + 0.5; since_s += 0.04) show(since_s);
  const double error =
      std::remainder(tracker.clock().at(at_s(now_s)).phase_rad - at_lock.at(at_s(now_s)).phase_rad - 0.1, kTwoPi);
  EXPECT_LT(std::abs(error), 0.05) << "the second breath is told by what was learnt in the first";
  EXPECT_TRUE(tracker.clock().doubtful()) << "corrected for less than half a breath";
  for (double since_s = period_s + 0.5; since_s < 1.5 * period_s + 0.1; since_s += 0.04) show(since_s);
  EXPECT_FALSE(tracker.clock().doubtful());
}

TEST_F(Tracking, WhatNoImageHasToldDoesNotCountAsCorrected) {
  RespiratoryTracker tracker(settings);
  ASSERT_TRUE(lock(tracker));
  const double rate = tracker.clock().rate_rad_per_s;
  now_s += 12.0;  // nothing is seen
  tracker.add_phase(at_s(now_s), tracker.clock().at(at_s(now_s)).phase_rad + 0.1, 0.05);
  EXPECT_TRUE(tracker.clock().doubtful());
  EXPECT_EQ(tracker.clock().rate_rad_per_s, rate);
}

TEST_F(Tracking, AMapThatCatchesUpForLongerIsNotAskedForLonger) {
  const auto corrects_after_s = [&](Duration catches_up) {
    RespiratoryTracker tracker(settings);
    if (!lock(tracker)) return 0.0;
    tracker.map_catches_up_for(catches_up);
    const double rate = tracker.clock().rate_rad_per_s;
    const double locked_s = now_s;
    while (tracker.clock().rate_rad_per_s == rate && now_s < locked_s + 30.0) {
      now_s += 1.0 / 30.0;
      tracker.add_phase(at_s(now_s), tracker.clock().at(at_s(now_s)).phase_rad + 0.1, 0.05);
    }
    return now_s - locked_s;
  };
  EXPECT_NEAR(corrects_after_s(Duration(0)), patient.period_s, 0.2);
  EXPECT_NEAR(corrects_after_s(from_seconds(2.0 * patient.period_s)), 2.0 * patient.period_s, 0.2);
}

TEST_F(Tracking, APhaseThatIsNotCorrectedYetIsNoneToGoOnFrom) {
  RespiratoryTracker tracker(settings);
  ASSERT_TRUE(lock(tracker));
  RespiratoryTracker later(settings);
  later.recall(tracker.memory(), at_s(now_s));
  EXPECT_EQ(later.clock().state, RespirationState::kSearching);
  EXPECT_EQ(later.locks(), 1) << "the map has coefficients by its wave all the same";
}

TEST_F(Tracking, AfterALossInTheFirstBreathTheNextOneIsTheFirst) {
  RespiratoryTracker tracker(settings);
  ASSERT_TRUE(lock(tracker));
  for (int i = 0; i < 60; ++i) tracker.add_contradiction(at_s(now_s += 1.0 / 30.0));
  ASSERT_EQ(tracker.clock().state, RespirationState::kSearching);
  ASSERT_TRUE(lock(tracker));
  const double rate = tracker.clock().rate_rad_per_s;
  for (int i = 0; i < 30; ++i) {
    now_s += 1.0 / 30.0;
    tracker.add_phase(at_s(now_s), tracker.clock().at(at_s(now_s)).phase_rad + 0.1, 0.01);
  }
  EXPECT_EQ(tracker.clock().rate_rad_per_s, rate);
}

TEST_F(Tracking, TheFirstBreathIsLostWhereTheImagesShowAnother) {
  RespiratoryTracker tracker(settings);
  ASSERT_TRUE(lock(tracker));
  const double begun_s = now_s;
  while (tracker.clock().state == RespirationState::kLocked && now_s < begun_s + 3.0) {
    now_s += 1.0 / 30.0;
    tracker.add_phase(at_s(now_s), tracker.clock().at(at_s(now_s)).phase_rad + 1.5, 0.05);
  }
  EXPECT_EQ(tracker.clock().state, RespirationState::kSearching);
}

TEST_F(Tracking, ThePhaseIsFollowedWhenTheRateDrifts) {
  RespiratoryTracker tracker(settings);
  ASSERT_TRUE(lock(tracker));
  // From now on slower, by 5 % within a minute.
  double phase = tracker.clock().at(at_s(now_s)).phase_rad;
  const double start_s = now_s;
  for (; now_s < start_s + 60.0; now_s += 1.0 / 30.0) {
    phase += kTwoPi / 4.0 * (1.0 - 0.05 * (now_s - start_s) / 60.0) / 30.0;
    tracker.add_phase(at_s(now_s + 1.0 / 30.0), phase + 0.05 * patient.normal(patient.generator), 0.05);
  }
  ASSERT_EQ(tracker.clock().state, RespirationState::kLocked);
  EXPECT_NEAR(std::remainder(tracker.clock().at(at_s(now_s)).phase_rad - phase, kTwoPi), 0.0, 0.1);
  EXPECT_NEAR(tracker.clock().rate_rad_per_s, kTwoPi / 4.0 * 0.95, 0.02);
}

TEST_F(Tracking, AContradictedPhaseIsSearchedForAgainAndCountedAsBefore) {
  RespiratoryTracker tracker(settings);
  ASSERT_TRUE(lock(tracker));
  const BreathWave before = tracker.wave();
  for (int i = 0; i < 90; ++i) tracker.add_contradiction(at_s(now_s += 1.0 / 30.0));
  EXPECT_EQ(tracker.clock().state, RespirationState::kSearching);
  patient.period_s = 3.3;  // the ventilator was set anew
  patient.begin_s = now_s + 1.0;
  ASSERT_TRUE(lock(tracker));
  EXPECT_EQ(tracker.locks(), 2);
  EXPECT_NEAR(to_seconds(tracker.clock().period()), 3.3, 0.1);
  // What the map has learnt at a phase still holds there.
  for (double t = now_s; t < now_s + 3.3; t += 0.2) {
    EXPECT_LT((before.at(tracker.clock().at(at_s(t)).phase_rad) - truth(t)).norm(), 1.0) << t;
  }
}

TEST_F(Tracking, WhileOffBreathingIsSuspectedWhereThereIsSome) {
  settings.enabled = false;
  RespiratoryTracker tracker(settings);
  for (int i = 0; i < 20; ++i) {
    watch(tracker, patient, i, i + 1.0);
    tracker.search(at_s(i + 1.0));
  }
  EXPECT_TRUE(tracker.clock().suspected);
  EXPECT_EQ(tracker.clock().state, RespirationState::kOff);
  EXPECT_EQ(tracker.clock().at(at_s(20.0)).deviation_mm, settings.displacement_mm);
  Patient still;
  still.amplitude_mm = 0.0;
  RespiratoryTracker calm(settings);
  for (int i = 0; i < 20; ++i) {
    watch(calm, still, i, i + 1.0);
    calm.search(at_s(i + 1.0));
  }
  EXPECT_FALSE(calm.clock().suspected);
  EXPECT_EQ(calm.clock().at(at_s(20.0)).deviation_mm, 0.0);
}

// The seconds of `now_s` until `to_s`, one search in each; how many of them ended in a suspicion.
int suspected_seconds(RespiratoryTracker& tracker, Patient& patient, double& now_s, double to_s) {
  int suspected = 0;
  for (; now_s < to_s; now_s += 1.0) {
    watch(tracker, patient, now_s, now_s + 1.0);
    tracker.search(at_s(now_s + 1.0));
    suspected += tracker.clock().suspected ? 1 : 0;
  }
  return suspected;
}

// Two waves of the map itself, at twice the heart's period, as records with a slow heart showed.
TEST_F(Tracking, WhileOffWhatAYoungMapGetsWrongForTwoBreathsIsNoSuspicion) {
  settings.enabled = false;
  for (const double fades_s : {0.6, 0.9, 1.2}) {
    RespiratoryTracker tracker(settings);
    for (int i = 0; i < 900; ++i) {
      const double t = i / 30.0;
      const double wave_mm = 8.0 * std::exp(-t / fades_s) * std::cos(kTwoPi * t / 2.4);
      const Vector3d noise(patient.normal(patient.generator), patient.normal(patient.generator), 0.0);
      tracker.add_displacement(at_s(t), Vector3d(wave_mm, 0.3 * wave_mm, 0.0) + 0.05 * noise, Patient::cardiac_rad(t));
      if (i % 30 == 29) tracker.search(at_s(t));
      ASSERT_FALSE(tracker.clock().suspected) << t << " s, fades in " << fades_s;
    }
  }
}

TEST_F(Tracking, WhileOffASuspicionStandsWhileThereIsBreathingAndGoesSoonAfterIt) {
  settings.enabled = false;
  RespiratoryTracker tracker(settings);
  EXPECT_GE(suspected_seconds(tracker, patient, now_s, 40.0), 25);
  ASSERT_TRUE(tracker.clock().suspected);
  patient.amplitude_mm = 0.0;
  patient.noise_mm = 0.1;
  // Two breaths and a little must have passed without it, and four searches more.
  EXPECT_GE(suspected_seconds(tracker, patient, now_s, 54.0), 8);
  EXPECT_FALSE(tracker.clock().suspected);
  EXPECT_EQ(suspected_seconds(tracker, patient, now_s, 100.0), 0);
}

TEST_F(Tracking, WhileOffAPauseOfABreathIsNoEndOfTheSuspicion) {
  settings.enabled = false;
  RespiratoryTracker tracker(settings);
  suspected_seconds(tracker, patient, now_s, 40.0);
  ASSERT_TRUE(tracker.clock().suspected);
  for (int pause = 0; pause < 3; ++pause) {
    const double amplitude_mm = std::exchange(patient.amplitude_mm, 0.0);
    EXPECT_EQ(suspected_seconds(tracker, patient, now_s, now_s + 4.0), 4);
    patient.amplitude_mm = amplitude_mm;
    EXPECT_EQ(suspected_seconds(tracker, patient, now_s, now_s + 12.0), 12);
  }
}

}  // namespace
}  // namespace perimap
