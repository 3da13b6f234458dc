#include "core/phase/phase_law.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <random>

#include "core/angle/angle.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/law_choice.hpp"

namespace perimap {
namespace {

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

TEST_P(EveryLaw, RateAndSensitivitiesAreTheDerivatives) {
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
      const double after_longer = phase_in_cycle(settings_, s, Seconds(rr), previous + Seconds(h)).phase_rad;
      const double after_shorter = phase_in_cycle(settings_, s, Seconds(rr), previous - Seconds(h)).phase_rad;
      EXPECT_NEAR(-(after_longer - after_shorter) / (2 * h) / at.rate_rad_per_s, at.previous_sensitivity, 1e-4)
          << rr << " " << share;
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
  EXPECT_NEAR(systole_slope(settings, Seconds(2.0), Seconds(0.5)), 0.0021 * 60.0 / 0.25, 1e-12);
  EXPECT_EQ(systole_slope(settings, Seconds(0.4), Seconds(1.0)), 0.0) << "a share of the cycle";
  EXPECT_GT(phase_in_cycle(settings, Seconds(0.4), Seconds(0.8), Seconds(0.8)).previous_sensitivity, 0.1);
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

TEST(PhaseLaw, ScaledLawsRunEvenlyInACycleOfTheUsualLength) {
  for (const double rr : {0.45, 0.6, 0.8, 1.1}) {
    for (const PhaseLaw law : {PhaseLaw::kLinear, PhaseLaw::kWarped, PhaseLaw::kTimeLocked}) {
      const PhaseLawSettings settings = law_even_at(law, Seconds(rr));
      for (double share = 0.05; share < 1.0; share += 0.1) {
        EXPECT_NEAR(phase_in_cycle(settings, Seconds(share * rr), Seconds(rr), Seconds(rr)).phase_rad,
                    2.0 * std::numbers::pi * share, 1e-9);
      }
    }
  }
}

double doubt_rad(const LawBelief& belief, Seconds since_r, Seconds rr, Seconds rr_previous) {
  const double told_rad = phase_in_cycle(belief.settings, since_r, rr, rr_previous).phase_rad;
  return law_deviation_rad(belief, told_rad, since_r, rr, rr_previous);
}

LawBelief undecided(Seconds usual) { return {law_even_at(PhaseLaw::kLinear, usual), {0.5, 0.5, 0.0}}; }

TEST(PhaseLaw, IsNoDoubtInACycleOfTheUsualLength) {
  const Seconds usual(0.85);
  for (double s = 0.05; s < 0.85; s += 0.1) {
    EXPECT_NEAR(doubt_rad(undecided(usual), Seconds(s), usual, usual), 0.0, 1e-9);
  }
}

TEST(PhaseLaw, IsInDoubtByWhatTheCandidatesDisagree) {
  const LawBelief belief = undecided(Seconds(0.85));
  const Seconds rr(1.1);
  const auto phase = [&](std::size_t i, Seconds s) {
    return phase_in_cycle(belief.with(kPhaseLaws[i]), s, rr, rr).phase_rad;
  };
  for (double s = 0.05; s < rr.count(); s += 0.1) {
    const double apart = std::abs(phase(1, Seconds(s)) - phase(0, Seconds(s)));
    EXPECT_NEAR(doubt_rad(belief, Seconds(s), rr, rr), std::sqrt(0.5) * apart, 1e-12);
  }
  EXPECT_GT(doubt_rad(belief, Seconds(0.35), rr, rr), 0.1);
  EXPECT_EQ(doubt_rad(LawBelief{belief.settings}, Seconds(0.35), rr, rr), 0.0);
}

TEST(PhaseLaw, InDoubtWidensThePhaseOfTheClock) {
  CardiacClockTracker tracker{CardiacClockSettings{}};
  Instant t = from_ns(5'000'000'000);
  Instant long_cycle = t;
  for (int i = 0; i < 12; ++i) {
    tracker.on_r_peak({t, t, 1.0, std::chrono::milliseconds(2)});
    if (i == 10) long_cycle = t;
    t += std::chrono::milliseconds(i == 10 ? 950 : 850);
  }
  const LawBelief belief = undecided(Seconds(0.85));
  const CardiacClock known = tracker.clock().with_law(LawBelief{belief.settings});
  const CardiacClock doubted = tracker.clock().with_law(belief);
  const auto check = [&](Instant at, Duration begun, double length_s) {
    const PhaseEstimate phase = doubted.at(at);
    const double off_rad = doubt_rad(belief, Seconds(begun), Seconds(length_s), Seconds(0.85));
    EXPECT_NEAR(phase.deviation_s, std::hypot(known.at(at).deviation_s, off_rad / phase.rate_rad_per_s), 1e-9);
    EXPECT_EQ(phase.phase_rad, known.at(at).phase_rad);
  };
  const Duration into = std::chrono::milliseconds(350);
  ASSERT_TRUE(doubted.at(long_cycle + into).exact);
  check(long_cycle + into, into, 0.95);
  EXPECT_GT(doubted.at(long_cycle + into).deviation_s, 3.0 * known.at(long_cycle + into).deviation_s);
}

TEST(PhaseLaw, IsUndecidedInTheClockWhereLawsThatAreNotRuledOutDiffer) {
  CardiacClockTracker tracker{CardiacClockSettings{}};
  Instant t = from_ns(5'000'000'000);
  for (int i = 0; i < 20; ++i) {
    tracker.on_r_peak({t, t, 1.0, std::chrono::milliseconds(2)});
    t += std::chrono::milliseconds(850);
  }
  const Instant now = t - std::chrono::milliseconds(500);
  const auto undecided_with = [&](const LawBelief& belief) {
    return tracker.clock().with_law(belief).at(now).law_undecided;
  };
  EXPECT_FALSE(undecided_with(undecided(Seconds(0.85)))) << "in a cycle of the usual length the laws are one";
  EXPECT_TRUE(undecided_with(undecided(Seconds(1.05))));
  EXPECT_FALSE(undecided_with({undecided(Seconds(1.05)).settings, {1.0, 0.0, 0.0}})) << "the others are ruled out";
}

// A heart that follows one of the laws, seen through a map that was learnt under the linear one and is off in its own
// way in each part of the cycle.
class ChosenLaw : public testing::TestWithParam<PhaseLaw> {};

TEST_P(ChosenLaw, IsTheOneThatTheHeartFollows) {
  std::mt19937 generator(11);
  std::normal_distribution<double> noise(0.0, 1.0);
  PhaseLawSettings truth;
  truth.law = GetParam();
  CardiacClockTracker tracker{CardiacClockSettings{}};
  LawChoice choice;
  Instant begin = from_ns(5'000'000'000);
  double previous_s = 0.85;
  int beats_to_choose = 0;
  for (int beat = 1; beat <= 100; ++beat) {
    tracker.on_r_peak({begin, begin + std::chrono::milliseconds(90), 1.0, std::chrono::milliseconds(2)});
    static_cast<void>(choice.on_beat(tracker.clock()));
    if (beats_to_choose == 0 && choice.belief().settings.law == GetParam()) beats_to_choose = beat;
    const double rr = 0.85 + 0.03 * std::sin(0.9 * beat) + 0.015 * noise(generator);
    for (double s = 0.01; s < rr; s += 1.0 / 30.0) {
      const double phase = phase_in_cycle(truth, Seconds(s), Seconds(rr), Seconds(previous_s)).phase_rad;
      const double off = 0.15 * std::sin(phase + 0.5);
      choice.add({begin + from_seconds(s), phase + off + 0.015 * noise(generator), 0.015});
    }
    previous_s = rr;
    begin += from_seconds(rr);
  }
  EXPECT_EQ(choice.belief().settings.law, GetParam());
  EXPECT_LE(beats_to_choose, 60);
  const LawBelief& belief = choice.belief();
  for (std::size_t i = 0; i < LawChoice::kLaws; ++i) {
    EXPECT_NEAR(belief.probabilities[i], kPhaseLaws[i] == GetParam() ? 1.0 : 0.0, 0.01);
  }
  for (const PhaseLaw other : {PhaseLaw::kLinear, PhaseLaw::kWarped, PhaseLaw::kTimeLocked}) {
    if (other == GetParam()) continue;
    EXPECT_GT(choice.scatter(other), 1.3 * choice.scatter(GetParam()));
  }

  LawChoice another_run;
  another_run.recall(choice.memory());
  EXPECT_EQ(another_run.belief().settings.law, GetParam());
  EXPECT_EQ(another_run.belief().probabilities, belief.probabilities);
  const auto phase = [](const LawBelief& b) {
    return phase_in_cycle(b.settings, Seconds(0.3), Seconds(1.0), Seconds(0.9)).phase_rad;
  };
  EXPECT_NEAR(phase(another_run.belief()), phase(belief), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(PhaseLaw, ChosenLaw,
                         testing::Values(PhaseLaw::kLinear, PhaseLaw::kWarped, PhaseLaw::kTimeLocked));

TEST(PhaseLaw, IsInDoubtUntilThereIsEvidence) {
  CardiacClockTracker tracker{CardiacClockSettings{}};
  LawChoice choice;
  Instant t = from_ns(5'000'000'000);
  for (int i = 0; i < 20; ++i) {
    tracker.on_r_peak({t, t, 1.0, std::chrono::milliseconds(2)});
    static_cast<void>(choice.on_beat(tracker.clock()));
    t += std::chrono::milliseconds(i % 2 == 0 ? 800 : 860);
    for (const double probability : choice.belief().probabilities) {
      EXPECT_NEAR(probability, i < 2 ? 0.0 : 1.0 / 3.0, 1e-12) << "after beat " << i;
    }
  }
}

TEST(PhaseLaw, IsScaledByTheCyclesThatNoPrematureBeatCutsShort) {
  CardiacClockTracker tracker{CardiacClockSettings{}};
  LawChoice choice;
  Instant t = from_ns(5'000'000'000);
  const auto beat = [&](BeatClass beat_class, Duration after) {
    t += after;
    RPeak peak{t, t, 1.0, std::chrono::milliseconds(2)};
    peak.beat_class = beat_class;
    tracker.on_r_peak(peak);
    static_cast<void>(choice.on_beat(tracker.clock()));
  };
  for (int i = 0; i < 4; ++i) beat(BeatClass::kNormal, std::chrono::milliseconds(900));
  for (int i = 0; i < 30; ++i) {
    beat(BeatClass::kPremature, std::chrono::milliseconds(500));
    beat(BeatClass::kNormal, std::chrono::milliseconds(1300));
  }
  ASSERT_EQ(tracker.clock().rhythm(), Rhythm::kEctopic);
  const PhaseLawSettings warped = choice.belief().with(PhaseLaw::kWarped);
  EXPECT_NEAR(phase_in_cycle(warped, Seconds(0.3), Seconds(0.9), Seconds(0.9)).phase_rad, kTwoPi / 3.0, 1e-3);
}

TEST(PhaseLaw, KnowsNothingFromARunThatKnewNothing) {
  LawChoice choice;
  choice.recall(LawChoice().memory());
  EXPECT_EQ(choice.belief().settings.law, PhaseLaw::kLinear);
  EXPECT_EQ(choice.belief().probabilities, LawChoice().belief().probabilities);
}

TEST(PhaseLaw, StaysLinearWithoutEvidence) {
  CardiacClockTracker tracker{CardiacClockSettings{}};
  LawChoice choice;
  for (int i = 0; i < 60; ++i) {
    const Instant t = from_ns(5'000'000'000) + i * std::chrono::milliseconds(800);
    tracker.on_r_peak({t, t, 1.0, std::chrono::milliseconds(2)});
    static_cast<void>(choice.on_beat(tracker.clock()));
  }
  EXPECT_EQ(choice.belief().settings.law, PhaseLaw::kLinear);
}

}  // namespace
}  // namespace perimap
