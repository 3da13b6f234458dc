#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/angle/angle.hpp"
#include "core/phase/respiration_search.hpp"
#include "core/phase/respiratory_tracker.hpp"

namespace perimap {
namespace {

using Eigen::Vector3d;

Instant at_s(double seconds) { return Instant(from_seconds(seconds)); }

// Breathing of 10 mm, at rest most of the time (sin^4), with a map's errors: white, a drift, and one in each heart
// beat.
struct Patient {
  double period_s = 4.0;
  double begin_s = 0.3;
  double amplitude_mm = 10.0;
  double noise_mm = 0.8;
  std::mt19937 generator{4};
  std::normal_distribution<double> normal{};

  [[nodiscard]] double breath(double t_s) const {
    const double sine = std::sin(std::numbers::pi * (t_s - begin_s) / period_s);
    return amplitude_mm * sine * sine * sine * sine;
  }
  [[nodiscard]] static double cardiac_rad(double t_s) { return std::fmod(kTwoPi * t_s / 0.83, kTwoPi); }

  Vector3d displacement(double t_s) {
    const Vector3d noise(normal(generator), normal(generator), normal(generator));
    return breath(t_s) * Vector3d(0.1, -0.35, -0.93) + noise_mm * noise + Vector3d(0.5, 0.02 * t_s, 0.0) +
           2.0 * std::cos(cardiac_rad(t_s)) * Vector3d(1.0, 0.0, 0.0);
  }
};

template <class Searching>
void watch(Searching& searching, Patient& patient, double from_s, double to_s) {
  for (double t = from_s; t < to_s; t += 1.0 / 30.0) {
    if constexpr (requires { searching.add(at_s(t), Vector3d(), 0.0); }) {
      searching.add(at_s(t), patient.displacement(t), Patient::cardiac_rad(t));
    } else {
      searching.add_displacement(at_s(t), patient.displacement(t), Patient::cardiac_rad(t));
    }
  }
}

TEST(RespirationSearch, FindsPeriodPhaseAndWaveWithinItsDeviations) {
  for (const double period_s : {2.3, 3.1, 4.0, 5.5}) {
    Patient patient;
    patient.period_s = period_s;
    RespirationSearch search;
    watch(search, patient, 0.0, 25.0);
    FoundBreath found;
    ASSERT_TRUE(search.find(found)) << period_s;
    const double rate = kTwoPi / period_s;
    EXPECT_LT(std::abs(found.rate_rad_per_s - rate), 4.0 * std::sqrt(found.rate_variance_rad2_per_s2)) << period_s;
    EXPECT_NEAR(found.rate_rad_per_s, rate, 0.005 * rate);
    // The wave lacks its mean, which is 3/8 of the amplitude.
    for (double ahead_s = 0.0; ahead_s < period_s; ahead_s += 0.1) {
      const double t = to_seconds(found.time.time_since_epoch()) + ahead_s;
      const Vector3d truth = (patient.breath(t) - 3.75) * Vector3d(0.1, -0.35, -0.93);
      EXPECT_LT((found.wave.at(found.rate_rad_per_s * ahead_s) - truth).norm(), 0.5) << period_s << " " << ahead_s;
    }
  }
}

TEST(RespirationSearch, TheFirstSecondsOfAYoungMapAreLeftOutWhereTheyAreWrong) {
  Patient patient;
  RespirationSearch search;
  for (double t = 0.0; t < 16.0; t += 1.0 / 30.0) {
    const Vector3d seen = patient.displacement(t);
    const bool young = t < 3.5;
    search.add(at_s(t), young ? Vector3d(0.2 * seen + Vector3d(0.0, -1.5, -4.0)) : seen, Patient::cardiac_rad(t));
  }
  FoundBreath found;
  ASSERT_TRUE(search.find(found));
  EXPECT_NEAR(kTwoPi / found.rate_rad_per_s, patient.period_s, 0.01 * patient.period_s);
  EXPECT_GT(found.explained, 0.9);
}

// The phase alone is known well enough before.
TEST(RespirationSearch, APeriodThatIsNotKnownToAPercentIsWaitedFor) {
  Patient patient;
  RespirationSearchSettings loose;
  loose.rate_deviation = 1.0;
  RespirationSearch first(loose);
  RespirationSearch search;
  FoundBreath found;
  int waited = 0;
  for (int i = 0; i < 40 * 30 && !search.find(found); ++i) {
    const double t = i / 30.0;
    const Vector3d seen = patient.displacement(t);
    first.add(at_s(t), seen, Patient::cardiac_rad(t));
    search.add(at_s(t), seen, Patient::cardiac_rad(t));
    if (first.find(found) && !search.find(found)) ++waited;
  }
  ASSERT_TRUE(search.find(found));
  EXPECT_GE(waited, 5);
  EXPECT_LE(std::sqrt(found.rate_variance_rad2_per_s2), 0.01 * found.rate_rad_per_s);
}

// Errors that are alike for two seconds, as a map's are.
TEST(RespirationSearch, TheDeviationsHoldForErrorsThatStayAlikeForTwoSeconds) {
  int beyond_two = 0;
  constexpr int kTrials = 40;
  for (int trial = 0; trial < kTrials; ++trial) {
    Patient patient;
    patient.generator.seed(static_cast<unsigned>(trial));
    patient.noise_mm = 0.3;
    RespirationSearch search;
    Vector3d slow = Vector3d::Zero();
    for (int i = 0; i < 20 * 30; ++i) {
      const double keep = std::exp(-1.0 / (30.0 * 1.0));
      for (double& axis : slow) axis = keep * axis + std::sqrt(1.0 - keep * keep) * patient.normal(patient.generator);
      const double t = i / 30.0;
      search.add(at_s(t), patient.displacement(t) + 0.6 * slow, Patient::cardiac_rad(t));
    }
    FoundBreath found;
    ASSERT_TRUE(search.find(found)) << trial;
    const double error = std::abs(found.rate_rad_per_s - kTwoPi / patient.period_s);
    beyond_two += error > 2.0 * std::sqrt(found.rate_variance_rad2_per_s2) ? 1 : 0;
  }
  EXPECT_LE(beyond_two, kTrials / 10);
}

TEST(RespirationSearch, FindsNothingInNoiseOrInTheHeartBeatOrBeforeTwoBreaths) {
  Patient still;
  still.amplitude_mm = 0.0;
  RespirationSearch search;
  watch(search, still, 0.0, 30.0);
  FoundBreath found;
  EXPECT_FALSE(search.find(found));
  search.clear();
  Patient patient;
  watch(search, patient, 0.0, 7.5);
  EXPECT_FALSE(search.find(found));
}

TEST(RespirationSearch, AWaveIsAlignedWithItselfWhereverItsPhaseIsCountedFrom) {
  Patient patient;
  RespirationSearch search;
  watch(search, patient, 0.0, 25.0);
  FoundBreath found;
  ASSERT_TRUE(search.find(found));
  for (const double turn : {0.0, 0.7, 2.5, 4.4}) {
    EXPECT_NEAR(std::remainder(alignment(found.wave, found.wave.shifted(turn)) - turn, kTwoPi), 0.0, 1e-3);
  }
}

struct Tracking : ::testing::Test {
  RespirationSettings settings;
  Patient patient;
  double now_s = 0.0;

  Tracking() { settings.enabled = true; }

  // Until locked; false when it does not within a minute.
  bool lock(RespiratoryTracker& tracker) {
    const double begun_s = now_s;
    while (tracker.clock().state != RespirationState::kLocked && now_s < begun_s + 60.0) {
      watch(tracker, patient, now_s, now_s + 1.0);
      now_s += 1.0;
      tracker.search(at_s(now_s));
    }
    return tracker.clock().state == RespirationState::kLocked;
  }
  // What the clock's phase says of the displacement, without the mean.
  static Vector3d predicted(const RespiratoryTracker& tracker, double t_s) {
    return tracker.wave().at(tracker.clock().at(at_s(t_s)).phase_rad);
  }
  [[nodiscard]] Vector3d truth(double t_s) const {
    return (patient.breath(t_s) - 0.375 * patient.amplitude_mm) * Vector3d(0.1, -0.35, -0.93);
  }
};

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

// The tracker follows the truth, crashes, and another goes on.
struct Restarted : Tracking {
  RespiratoryTracker before{settings};

  void SetUp() override {
    ASSERT_TRUE(lock(before));
    follow(before, now_s + 20.0);
  }
  void follow(RespiratoryTracker& tracker, double to_s) {
    for (; now_s < to_s; now_s += 1.0 / 30.0) {
      const double shift = 0.05 * patient.normal(patient.generator);
      tracker.add_phase(at_s(now_s), tracker.clock().at(at_s(now_s)).phase_rad + shift, 0.05);
    }
  }
  [[nodiscard]] RespiratoryTracker after(double gap_s) const {
    RespiratoryTracker tracker(settings);
    tracker.recall(before.memory(), at_s(now_s + gap_s));
    return tracker;
  }
};

TEST_F(Restarted, ThePhaseGoesOnWhereItWouldHaveBeenAndIsAsMuchLessCertain) {
  double last_mm = before.clock().at(at_s(now_s)).deviation_mm;
  for (const double gap_s : {0.0, 0.5, 2.0, 8.0}) {
    const RespiratoryTracker there = after(gap_s);
    ASSERT_EQ(there.clock().state, RespirationState::kLocked) << gap_s;
    const RespiratoryPhase was = before.clock().at(at_s(now_s + gap_s));
    const RespiratoryPhase is = there.clock().at(at_s(now_s + gap_s));
    EXPECT_NEAR(std::remainder(is.phase_rad - was.phase_rad, kTwoPi), 0.0, 1e-9) << gap_s;
    EXPECT_EQ(is.rate_rad_per_s, was.rate_rad_per_s);
    EXPECT_GE(is.deviation_mm, was.deviation_mm) << "nobody followed the walks meanwhile";
    EXPECT_GE(is.deviation_mm, last_mm) << gap_s;
    last_mm = is.deviation_mm;
    EXPECT_EQ(there.wave().at(1.0), before.wave().at(1.0));
  }
  // One step of seconds adds what many small ones do.
  RespiratoryTracker at_once = after(2.0);
  RespiratoryTracker step_by_step = after(0.0);
  for (int i = 1; i <= 20; ++i) {
    RespiratoryTracker next(settings);
    next.recall(step_by_step.memory(), at_s(now_s + 0.1 * i));
    step_by_step = next;
  }
  EXPECT_NEAR(step_by_step.clock().phase_variance_rad2 / at_once.clock().phase_variance_rad2, 1.0, 1e-6);
  EXPECT_NEAR(step_by_step.clock().rate_variance_rad2_per_s2 / at_once.clock().rate_variance_rad2_per_s2, 1.0, 1e-6);
}

TEST_F(Restarted, APhaseThatIsTooOldIsSearchedForAndCountedAsBefore) {
  const BreathWave wave = before.wave();
  RespiratoryTracker there = after(300.0);
  EXPECT_EQ(there.clock().state, RespirationState::kSearching);
  EXPECT_EQ(there.clock().at(at_s(now_s + 300.0)).deviation_mm, settings.displacement_mm);
  now_s += 300.0;
  patient.begin_s += 1.7;
  ASSERT_TRUE(lock(there));
  for (double t = now_s; t < now_s + 4.0; t += 0.2) {
    EXPECT_LT((wave.at(there.clock().at(at_s(t)).phase_rad) - truth(t)).norm(), 1.0) << t;
  }
}

TEST_F(Restarted, ThePhaseIsContradictedAsEver) {
  RespiratoryTracker there = after(2.0);
  now_s += 2.0;
  for (int i = 0; i < 90; ++i) there.add_contradiction(at_s(now_s += 1.0 / 30.0));
  EXPECT_EQ(there.clock().state, RespirationState::kSearching);
  EXPECT_GT(there.locks(), 0) << "the map's coefficients count from the phase of then";
}

TEST_F(Restarted, ARateThatIsNotLookedForIsNotGoneOnWith) {
  settings.search.shortest_period = std::chrono::seconds(8);
  EXPECT_EQ(after(0.5).clock().state, RespirationState::kSearching);
}

TEST_F(Restarted, WhereBreathingIsOffOnlyASuspicionStands) {
  settings.enabled = false;
  RespiratoryTracker there = after(0.5);
  EXPECT_EQ(there.clock().state, RespirationState::kOff);
  EXPECT_FALSE(there.clock().suspected);
  RespirationMemory suspected = there.memory();
  suspected.clock.suspected = true;
  there.recall(suspected, at_s(now_s));
  EXPECT_EQ(there.clock().at(at_s(now_s)).deviation_mm, settings.displacement_mm);
}

// A channel that shows the patient's breath until `until_s`, then a flat line.
struct Channel {
  const Patient& patient;
  double until_s = 1e9;
  BreathDetector detector{};
  double heard_s = 0.0;

  const BreathSignal& at(double now_s) {
    for (; heard_s < now_s; heard_s += 0.02)
      detector.push(at_s(heard_s), heard_s < until_s ? patient.breath(heard_s) : 0.0);
    return detector.signal();
  }
};

struct WithChannel : Tracking {
  Channel channel{patient};

  // The map begins to tell displacements at `from_s`.
  bool lock_by_channel(RespiratoryTracker& tracker, double from_s) {
    for (now_s = from_s; tracker.clock().state != RespirationState::kLocked && now_s < from_s + 60.0; now_s += 1.0) {
      watch(tracker, patient, now_s, now_s + 1.0);
      tracker.track_signal(channel.at(now_s + 1.0), at_s(now_s + 1.0));
      tracker.search(at_s(now_s + 1.0));
    }
    return tracker.clock().state == RespirationState::kLocked;
  }
};

TEST_F(WithChannel, TheMapsDisplacementIsFoundAtTheChannelsPeriod) {
  RespiratoryTracker with(settings);
  ASSERT_TRUE(lock_by_channel(with, 12.0));
  EXPECT_EQ(with.clock().source, RespirationSource::kChannel);
  EXPECT_LT(now_s, 12.0 + 11.0);
  EXPECT_NEAR(to_seconds(with.clock().period()), 4.0, 0.05);
  for (double t = now_s; t < now_s + 4.0; t += 0.2) EXPECT_LT((predicted(with, t) - truth(t)).norm(), 1.5) << t;
  RespiratoryTracker without(settings);
  const double with_channel_s = now_s;
  now_s = 12.0;
  ASSERT_TRUE(lock(without));
  EXPECT_EQ(without.clock().source, RespirationSource::kImage);
  EXPECT_GE(now_s, with_channel_s);
}

TEST_F(WithChannel, AStoppedBreathIsLostWhenTheNextIsOverdueAndCountedAsBeforeWhenItComes) {
  RespiratoryTracker tracker(settings);
  ASSERT_TRUE(lock_by_channel(tracker, 12.0));
  const BreathWave before = tracker.wave();
  channel.until_s = now_s;
  double lost_s = 0.0;
  for (; now_s < channel.until_s + 20.0; now_s += 1.0 / 30.0) {
    tracker.track_signal(channel.at(now_s), at_s(now_s));
    if (lost_s == 0.0 && tracker.clock().state == RespirationState::kSearching) lost_s = now_s;
  }
  EXPECT_GT(lost_s, 0.0);
  EXPECT_LT(lost_s, channel.until_s + 1.5 * 4.0 + 0.2);
  channel.until_s = 1e9;
  patient.begin_s += 1.3;  // it goes on at another time than it would have
  ASSERT_TRUE(lock_by_channel(tracker, now_s));
  for (double t = now_s; t < now_s + 4.0; t += 0.2) {
    EXPECT_LT((before.at(tracker.clock().at(at_s(t)).phase_rad) - truth(t)).norm(), 1.5) << t;
  }
}

TEST_F(WithChannel, AfterARestartTheChannelsPhaseIsCountedAsBefore) {
  RespiratoryTracker before(settings);
  ASSERT_TRUE(lock_by_channel(before, 12.0));
  RespiratoryTracker there(settings);
  there.recall(before.memory(), at_s(now_s + 60.0));
  ASSERT_EQ(there.clock().state, RespirationState::kSearching);
  channel.detector = BreathDetector{};
  channel.heard_s = now_s + 30.0;
  ASSERT_TRUE(lock_by_channel(there, now_s + 60.0));
  EXPECT_EQ(there.clock().source, RespirationSource::kChannel);
  for (double t = now_s; t < now_s + 4.0; t += 0.2) {
    EXPECT_LT((before.wave().at(there.clock().at(at_s(t)).phase_rad) - truth(t)).norm(), 1.5) << t;
  }
}

TEST_F(WithChannel, WhereTheChannelIsGoneTheImagesCarryOn) {
  RespiratoryTracker tracker(settings);
  ASSERT_TRUE(lock_by_channel(tracker, 12.0));
  const BreathSignal last = channel.detector.signal();
  for (int i = 0; i < 300; ++i) {
    now_s += 1.0 / 30.0;
    tracker.track_signal(last, at_s(now_s));
    tracker.add_phase(at_s(now_s), tracker.clock().at(at_s(now_s)).phase_rad, 0.05);
  }
  EXPECT_EQ(tracker.clock().state, RespirationState::kLocked);
  EXPECT_EQ(tracker.clock().source, RespirationSource::kImage);
}

TEST_F(WithChannel, WhereNobodyBreathesInTheChannelItTellsNothing) {
  RespiratoryTracker tracker(settings);
  channel.until_s = 0.0;
  for (now_s = 0.0; now_s < 30.0; now_s += 1.0) {
    tracker.track_signal(channel.at(now_s), at_s(now_s));
    tracker.search(at_s(now_s));
  }
  EXPECT_EQ(tracker.clock().state, RespirationState::kSearching);
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

}  // namespace
}  // namespace perimap
