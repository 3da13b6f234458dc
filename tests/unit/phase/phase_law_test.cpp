#include "core/phase/phase_law.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace perimap {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

class EveryLaw : public testing::TestWithParam<PhaseLaw> {
 protected:
  EveryLaw() { settings_.law = GetParam(); }
  PhaseLawSettings settings_;
};

TEST_P(EveryLaw, RunsFromZeroToOneTurnWithoutAJumpOrAStop) {
  for (const double rr : {0.25, 0.4, 0.6, 0.863, 1.2, 2.0}) {
    for (const double previous : {0.25, 0.7, 1.5}) {
      double last = 0.0;
      for (int i = 0; i <= 10000; ++i) {
        const CyclePhase at = phase_in_cycle(settings_, Seconds(rr * i / 10000), Seconds(rr), Seconds(previous));
        EXPECT_GT(at.rate_rad_per_s, 0.0);
        EXPECT_GE(at.phase_rad, last);
        EXPECT_LT(at.phase_rad - last, 0.05);
        last = at.phase_rad;
      }
      EXPECT_NEAR(last, kTwoPi, 1e-12);
      EXPECT_EQ(phase_in_cycle(settings_, Seconds(0.0), Seconds(rr), Seconds(previous)).phase_rad, 0.0);
    }
  }
}

TEST_P(EveryLaw, RateAndSensitivityAreTheDerivatives) {
  const Seconds previous(0.8);
  for (const double rr : {0.45, 0.863, 1.3}) {
    for (const double share : {0.03, 0.2, 0.33, 0.48, 0.71, 0.88, 0.97}) {
      const Seconds s(share * rr);
      const double h = 1e-6;
      const CyclePhase at = phase_in_cycle(settings_, s, Seconds(rr), previous);
      const double later = phase_in_cycle(settings_, s + Seconds(h), Seconds(rr), previous).phase_rad;
      const double earlier = phase_in_cycle(settings_, s - Seconds(h), Seconds(rr), previous).phase_rad;
      EXPECT_NEAR((later - earlier) / (2 * h), at.rate_rad_per_s, 1e-4) << rr << " " << share;
      const double longer = phase_in_cycle(settings_, s, Seconds(rr + h), previous).phase_rad;
      const double shorter = phase_in_cycle(settings_, s, Seconds(rr - h), previous).phase_rad;
      EXPECT_NEAR(-(longer - shorter) / (2 * h) / at.rate_rad_per_s, at.length_sensitivity, 1e-4) << rr << " " << share;
    }
  }
}

TEST_P(EveryLaw, HoldsBeforeItsBeginningAndAfterItsEnd) {
  EXPECT_EQ(phase_in_cycle(settings_, Seconds(-1.0), Seconds(0.8), Seconds(0.8)).phase_rad, 0.0);
  EXPECT_NEAR(phase_in_cycle(settings_, Seconds(9.0), Seconds(0.8), Seconds(0.8)).phase_rad, kTwoPi, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(PhaseLaw, EveryLaw,
                         testing::Values(PhaseLaw::kLinear, PhaseLaw::kWarped, PhaseLaw::kTimeLocked));

TEST(PhaseLaw, WarpedSystoleFollowsTheBeatBefore) {
  PhaseLawSettings settings;
  settings.law = PhaseLaw::kWarped;
  EXPECT_NEAR(systole_duration(settings, Seconds(2.0), Seconds(1.0)).count(), 0.546 - 0.0021 * 60.0, 1e-12);
  EXPECT_NEAR(systole_duration(settings, Seconds(0.4), Seconds(1.0)).count(), 0.3, 1e-12);
}

TEST(PhaseLaw, TimeLockedSystoleAndAtrialFillingDoNotStretch) {
  PhaseLawSettings settings;
  settings.law = PhaseLaw::kTimeLocked;
  const auto at = [&](double s, double rr) {
    return phase_in_cycle(settings, Seconds(s), Seconds(rr), Seconds(0.8)).phase_rad;
  };
  EXPECT_NEAR(at(0.3, 0.8), at(0.3, 1.2), 1e-12);
  EXPECT_NEAR(at(0.8 - 0.1, 0.8), at(1.2 - 0.1, 1.2), 1e-12);
}

}  // namespace
}  // namespace perimap
