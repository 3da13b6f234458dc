#include "drivers/standins/truth/heart_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

// Regular, early (short for every law's fixed parts) and late beats.
HeartMotion motion_with(MotionLaw law) {
  HeartMotion motion;
  motion.law = law;
  Instant t{std::chrono::seconds(100)};
  motion.r_peaks.push_back(t);
  for (const int rr_ms : {860, 850, 420, 1240, 870, 300, 300, 1600, 900})
    motion.r_peaks.push_back(t += milliseconds(rr_ms));
  return motion;
}

class EveryLaw : public testing::TestWithParam<MotionLaw> {};

TEST_P(EveryLaw, StartsEachCycleAtPhaseZero) {
  const HeartMotion motion = motion_with(GetParam());
  ASSERT_TRUE(check(motion).has_value());
  for (const Instant r_peak : motion.r_peaks) {
    EXPECT_NEAR(motion_phase(motion, r_peak).phase_rad, 0.0, 1e-12);
    EXPECT_NEAR(motion_phase(motion, r_peak - Duration(1)).phase_rad, kTwoPi, 1e-6);
  }
}

TEST_P(EveryLaw, RisesWithoutJumpsAtTheRateItTells) {
  const HeartMotion motion = motion_with(GetParam());
  const Duration step = microseconds(100);
  const Instant end = motion.r_peaks.back() + std::chrono::seconds(2);
  double before = motion_phase(motion, motion.r_peaks.front() - std::chrono::seconds(2)).phase_rad;
  for (Instant t = motion.r_peaks.front() - std::chrono::seconds(2) + step; t < end; t += step) {
    const MotionPhase now = motion_phase(motion, t);
    ASSERT_GE(now.phase_rad, 0.0);
    ASSERT_LT(now.phase_rad, kTwoPi);
    double rise = now.phase_rad - before;
    if (rise < -std::numbers::pi) rise += kTwoPi;
    ASSERT_GT(rise, 0.0) << "at " << to_seconds(t.time_since_epoch()) << " s";
    ASSERT_LT(rise, 0.03) << "at " << to_seconds(t.time_since_epoch()) << " s";
    ASSERT_GT(now.rate_rad_per_s, 0.0);
    // The rate is that of the piece t lies in: it may only differ from the rise across a corner.
    const double next = motion_phase(motion, t + step).phase_rad;
    if (next > now.phase_rad && motion_phase(motion, t + step).rate_rad_per_s == now.rate_rad_per_s) {
      ASSERT_NEAR(next - now.phase_rad, now.rate_rad_per_s * to_seconds(step), 1e-9);
    }
    before = now.phase_rad;
  }
}

INSTANTIATE_TEST_SUITE_P(HeartMotion, EveryLaw,
                         testing::Values(MotionLaw::kLinear, MotionLaw::kWarped, MotionLaw::kTimeLocked));

TEST(HeartMotion, LinearLawHalvesTheCycleInItsMiddle) {
  const HeartMotion motion = motion_with(MotionLaw::kLinear);
  EXPECT_NEAR(motion_phase(motion, motion.r_peaks[3] + milliseconds(620)).phase_rad, std::numbers::pi, 1e-9);
}

TEST(HeartMotion, WarpedLawEndsSystoleWhenTheBeatBeforeSays) {
  const HeartMotion motion = motion_with(MotionLaw::kWarped);
  const double phase = kTwoPi * 0.4;
  // After 860 ms: 0.546 - 0.0021 * 60 / 0.86 s; the coming length does not matter.
  const Duration usual = from_seconds(0.546 - 0.0021 * 60.0 / 0.860);
  EXPECT_NEAR(motion_phase(motion, motion.r_peaks[1] + usual).phase_rad, phase, 1e-7);
  // A cycle of 420 ms after one of 850 ms: at most three quarters of it.
  EXPECT_NEAR(motion_phase(motion, motion.r_peaks[2] + milliseconds(315)).phase_rad, phase, 1e-7);
}

TEST(HeartMotion, TimeLockedLawStretchesDiastasisAlone) {
  const HeartMotion motion = motion_with(MotionLaw::kTimeLocked);
  for (const std::size_t cycle : {0U, 3U, 7U}) {  // 860, 1240 and 1600 ms
    EXPECT_NEAR(motion_phase(motion, motion.r_peaks[cycle] + motion.locked_systole).phase_rad,
                motion.locked_systole_phase_rad, 1e-7);
    EXPECT_NEAR(motion_phase(motion, motion.r_peaks[cycle + 1] - motion.locked_filling).phase_rad,
                motion.locked_filling_phase_rad, 1e-7);
  }
}

TEST(HeartMotion, RefusesPeaksThatDoNotAscend) {
  HeartMotion motion = motion_with(MotionLaw::kLinear);
  motion.r_peaks[4] = motion.r_peaks[3];
  EXPECT_EQ(check(motion).error().message, "heart motion: R peak 4 does not come after the one before");
  motion.r_peaks.resize(1);
  EXPECT_EQ(check(motion).error().message, "heart motion: fewer than two R peaks");
}

TEST(HeartMotion, RefusesValuesALawCannotUse) {
  HeartMotion warped = motion_with(MotionLaw::kWarped);
  warped.systole_fraction = 1.0;
  EXPECT_FALSE(check(warped).has_value());
  HeartMotion locked = motion_with(MotionLaw::kTimeLocked);
  locked.locked_filling_phase_rad = locked.locked_systole_phase_rad;
  EXPECT_FALSE(check(locked).has_value());
}

TEST(HeartMotion, BreathesFromRestToFullInspirationAndBack) {
  HeartMotion motion = motion_with(MotionLaw::kLinear);
  const Instant rest{std::chrono::seconds(400)};
  EXPECT_EQ(respiration_displacement(motion, rest + milliseconds(700)), Vector3d::Zero());
  motion.respiration_period = std::chrono::seconds(4);
  motion.respiration_mm = Vector3d(1.0, -2.0, 6.0);
  EXPECT_LT(respiration_displacement(motion, rest).norm(), 1e-12);
  EXPECT_LT((respiration_displacement(motion, rest + std::chrono::seconds(2)) - motion.respiration_mm).norm(), 1e-12);
  EXPECT_LT((respiration_displacement(motion, rest + std::chrono::seconds(1)) - 0.25 * motion.respiration_mm).norm(),
            1e-12);
}

}  // namespace
}  // namespace perimap
