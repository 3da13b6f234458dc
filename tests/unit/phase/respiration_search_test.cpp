#include "core/phase/respiration_search.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "breathing_patient.hpp"
#include "core/angle/angle.hpp"

namespace perimap {
namespace {

using Eigen::Vector3d;
using test::at_s;
using test::Patient;
using test::watch;

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

}  // namespace
}  // namespace perimap
