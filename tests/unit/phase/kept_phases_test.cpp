#include "core/phase/kept_phases.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr std::size_t kCapacity = 16;
constexpr double kRate_rad_per_s = 7.0;
const Instant begin = Instant(milliseconds(5000));

// A phase that runs evenly, said with another multiple of 2 pi each time.
ObservedPhase seen(double t_s, int turns = 0) {
  return {begin + from_seconds(t_s), kRate_rad_per_s * t_s + turns * kTwoPi, 0.02};
}

TEST(KeptPhases, AreWhatWasAddedUpToSixtyFramesASecond) {
  KeptPhases<kCapacity> kept;
  EXPECT_EQ(kept.size(), 0U);
  for (int i = 0; i < 40; ++i) kept.add(seen(i / 60.0));
  ASSERT_EQ(kept.size(), kCapacity);
  for (std::size_t i = 0; i < kCapacity; ++i) {
    const ObservedPhase as = seen(static_cast<double>(24 + i) / 60.0);
    EXPECT_EQ(kept[i].time, as.time);
    EXPECT_EQ(kept[i].phase_rad, as.phase_rad);
    EXPECT_EQ(kept[i].deviation_rad, as.deviation_rad);
  }
}

TEST(KeptPhases, ReachAsFarBackHoweverFastTheCamera) {
  for (const double rate_per_s : {90.0, 120.0, 240.0, 500.0}) {
    SCOPED_TRACE(rate_per_s);
    KeptPhases<kCapacity> kept;
    const int frames = static_cast<int>(rate_per_s);
    for (int i = 0; i < frames; ++i) kept.add(seen(i / rate_per_s));
    ASSERT_EQ(kept.size(), kCapacity);
    EXPECT_GE(kept.newest().time - kept[0].time, (kCapacity - 2) * KeptPhases<kCapacity>::kEvery);
  }
}

TEST(KeptPhases, JoinedOnesTellAllThatWasSeen) {
  KeptPhases<kCapacity> kept;
  constexpr int kFrames = 32;
  for (int i = 0; i < kFrames; ++i) kept.add(seen(i / 240.0, i % 3 - 1));
  ASSERT_LT(kept.size(), kCapacity);
  double precision = 0.0;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const double expected_rad = kRate_rad_per_s * to_seconds(kept[i].time - begin);
    EXPECT_NEAR(std::remainder(kept[i].phase_rad - expected_rad, kTwoPi), 0.0, 1e-7);
    precision += 1.0 / (kept[i].deviation_rad * kept[i].deviation_rad);
  }
  EXPECT_NEAR(precision, kFrames / (0.02 * 0.02), 1e-6 * precision);
  EXPECT_EQ(kept.newest().time, seen((kFrames - 1) / 240.0).time);
}

TEST(KeptPhases, OneOfEarlierOrWithoutADeviationIsNotJoined) {
  KeptPhases<kCapacity> kept;
  kept.add(seen(1.0));
  kept.add(seen(0.999));
  EXPECT_EQ(kept.size(), 2U);
  ObservedPhase worthless = seen(1.001);
  worthless.deviation_rad = 0.0;
  kept.add(worthless);
  EXPECT_EQ(kept.size(), 3U);
  kept.add(seen(1.002));
  EXPECT_EQ(kept.size(), 4U);
}

}  // namespace
}  // namespace perimap
