// The breath is gone on with after a crash, and told by a channel of its own.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "breathing_patient.hpp"
#include "core/angle/angle.hpp"
#include "core/phase/breath_detector.hpp"
#include "core/phase/respiratory_tracker.hpp"

namespace perimap {
namespace {

using Eigen::Vector3d;
using test::at_s;
using test::Patient;
using test::Tracking;
using test::watch;

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

}  // namespace
}  // namespace perimap
