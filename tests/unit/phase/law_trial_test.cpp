#include "core/phase/law_trial.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <vector>

#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/law_choice.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;
using Costs = std::array<double, kPhaseLaws.size()>;  // linear, warped, time-locked

constexpr Costs kWarpedExplains{80.0, 20.0, 60.0};
// Ten more than the best: by half of it, 5, the best is the more likely.
constexpr Costs kWarpedALittle{30.0, 20.0, 22.0};

struct LawTrials : ::testing::Test {
  CardiacClockTracker tracker{CardiacClockSettings{}};
  LawChoice choice;
  Instant beat = from_ns(5'000'000'000);

  // Beats from which the usual length is known, each weighed.
  LawTrials() {
    for (int i = 0; i < 10; ++i) next_beat();
  }
  void next_beat() {
    tracker.on_r_peak({beat, beat, 1.0, milliseconds(2)});
    static_cast<void>(choice.on_beat(tracker.clock()));
    beat += milliseconds(800);
  }

  static std::vector<LawTrial> of(std::size_t features, const Costs& costs, milliseconds begin = milliseconds(5000),
                                  milliseconds end = milliseconds(7000)) {
    return {features, LawTrial{costs, Instant(begin), Instant(end)}};
  }
  bool weigh(std::vector<LawTrial> trials) { return choice.weigh(trials); }
  [[nodiscard]] double odds_of_linear() const {
    return choice.belief().probabilities[index_of(PhaseLaw::kLinear)] /
           choice.belief().probabilities[index_of(PhaseLaw::kWarped)];
  }
};

TEST_F(LawTrials, TellTheLawAtOnce) {
  EXPECT_TRUE(weigh(of(20, kWarpedExplains)));
  EXPECT_EQ(choice.belief().settings.law, PhaseLaw::kWarped);
  EXPECT_FALSE(choice.belief().laws().undecided());
}

TEST_F(LawTrials, OfFewFeaturesTellNothing) {
  EXPECT_FALSE(weigh(of(7, kWarpedExplains)));
  EXPECT_NEAR(odds_of_linear(), 1.0, 1e-12);
  EXPECT_FALSE(weigh({}));
  EXPECT_TRUE(weigh(of(8, kWarpedExplains))) << "nor do they stand for what others saw at the same time";
}

TEST_F(LawTrials, CountAsOneHoweverManyFeaturesStartTogether) {
  for (const std::size_t features : {std::size_t{8}, std::size_t{100}}) {
    choice = LawChoice();
    static_cast<void>(weigh(of(features, kWarpedALittle)));
    EXPECT_NEAR(odds_of_linear(), std::exp(-5.0), 1e-9) << features;
  }
}

TEST_F(LawTrials, GoByTheMiddleOfTheFeatures) {
  std::vector<LawTrial> trials = of(12, kWarpedALittle);
  // Of others the picture slid on.
  for (const LawTrial& slid : of(10, {100.0, 5000.0, 4000.0})) trials.push_back(slid);
  static_cast<void>(weigh(trials));
  EXPECT_NEAR(odds_of_linear(), std::exp(-5.0), 1e-9);
}

TEST_F(LawTrials, OfTheSameTimeCountOnce) {
  constexpr Costs kSomeDoubt{22.0, 20.0, 21.0};
  static_cast<void>(weigh(of(10, kSomeDoubt, milliseconds(5000), milliseconds(7000))));
  EXPECT_NEAR(odds_of_linear(), std::exp(-1.0), 1e-9);
  static_cast<void>(weigh(of(10, kSomeDoubt, milliseconds(5000), milliseconds(7000))));
  EXPECT_NEAR(odds_of_linear(), std::exp(-1.0), 1e-9);
  static_cast<void>(weigh(of(10, kSomeDoubt, milliseconds(6000), milliseconds(8000))));
  EXPECT_NEAR(odds_of_linear(), std::exp(-1.5), 1e-9) << "half of it is new";
}

TEST_F(LawTrials, GiveWayToWhatIsSeenLater) {
  static_cast<void>(weigh(of(10, kWarpedExplains)));
  const double at_first = choice.memory().log_likelihoods[index_of(PhaseLaw::kLinear)];
  for (int i = 0; i < 100; ++i) next_beat();
  EXPECT_NEAR(choice.memory().log_likelihoods[index_of(PhaseLaw::kLinear)] / at_first, std::exp(-1.0), 0.01);
}

TEST_F(LawTrials, AreRememberedByTheNextRun) {
  static_cast<void>(weigh(of(10, kWarpedExplains)));
  LawChoice next;
  next.recall(choice.memory());
  EXPECT_EQ(next.belief().laws(), choice.belief().laws());
  EXPECT_EQ(next.belief().probabilities, choice.belief().probabilities);
}

TEST_F(LawTrials, DoNotSetTheScaleByTheFirstCyclesOfABigeminy) {
  choice = LawChoice();
  EXPECT_FALSE(weigh(of(10, kWarpedExplains))) << "no cycle has told the usual length";
  EXPECT_EQ(choice.belief().settings.law, PhaseLaw::kLinear);
  next_beat();
  EXPECT_EQ(choice.belief().settings.law, PhaseLaw::kWarped) << "nothing is lost of it";
}

}  // namespace
}  // namespace perimap
