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
// Six more than the best: by half of it, 3, the best is the more likely.
constexpr Costs kWarpedALittle{26.0, 20.0, 22.0};

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

TEST_F(LawTrials, AreOutweighedByLaterOnesHoweverClearTheySeemed) {
  static_cast<void>(weigh(of(20, {20'000.0, 20.0, 20'000.0})));
  for (int i = 1; i <= 2; ++i)
    static_cast<void>(weigh(of(20, {20.0, 80.0, 60.0}, milliseconds(5000 + 2000 * i), milliseconds(7000 + 2000 * i))));
  EXPECT_EQ(choice.belief().settings.law, PhaseLaw::kLinear);
}

TEST_F(LawTrials, OfFewFeaturesTellNothing) {
  EXPECT_FALSE(weigh(of(LawChoice::kFewestTrials - 1, kWarpedExplains)));
  EXPECT_NEAR(odds_of_linear(), 1.0, 1e-12);
  EXPECT_FALSE(weigh({}));
  EXPECT_TRUE(weigh(of(LawChoice::kFewestTrials, kWarpedExplains))) << "nor do they stand for others of that time";
}

TEST_F(LawTrials, CountAsOneHoweverManyFeaturesStartTogether) {
  for (const std::size_t features : {std::size_t{8}, std::size_t{100}}) {
    choice = LawChoice();
    static_cast<void>(weigh(of(features, kWarpedALittle)));
    EXPECT_NEAR(odds_of_linear(), std::exp(-3.0), 1e-9) << features;
  }
}

TEST_F(LawTrials, GoByTheMiddleOfTheFeatures) {
  std::vector<LawTrial> trials = of(12, kWarpedALittle);
  // Of others the picture slid on.
  for (const LawTrial& slid : of(10, {100.0, 5000.0, 4000.0})) trials.push_back(slid);
  static_cast<void>(weigh(trials));
  EXPECT_NEAR(odds_of_linear(), std::exp(-3.0), 1e-9);
}

TEST_F(LawTrials, OfTheSameTimeCountOnce) {
  constexpr Costs kSomeDoubt{22.0, 20.0, 21.0};
  const std::vector<LawTrial> first = of(30, kSomeDoubt, milliseconds(5000), milliseconds(7000));
  static_cast<void>(weigh(first));
  EXPECT_NEAR(odds_of_linear(), std::exp(-1.0), 1e-9);
  static_cast<void>(weigh(first));
  EXPECT_NEAR(odds_of_linear(), std::exp(-1.0), 1e-9);

  std::vector<LawTrial> with_later = first;
  for (const LawTrial& later : of(LawChoice::kFewestTrials - 1, kSomeDoubt, milliseconds(6000), milliseconds(8000)))
    with_later.push_back(later);
  static_cast<void>(weigh(with_later));
  EXPECT_NEAR(odds_of_linear(), std::exp(-1.0), 1e-9) << "the old ones do not make up for what few there are";
  with_later.push_back(with_later.back());
  static_cast<void>(weigh(with_later));
  EXPECT_NEAR(odds_of_linear(), std::exp(-1.5), 1e-9) << "half of the later ones' time is new";
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

TEST_F(LawTrials, WaitForTheUsualLengthToBeKnown) {
  choice = LawChoice();
  EXPECT_FALSE(weigh(of(10, kWarpedExplains)));
  next_beat();
  EXPECT_EQ(choice.belief().settings.law, PhaseLaw::kLinear);
  EXPECT_GT(choice.belief().probabilities[index_of(PhaseLaw::kWarped)], 0.9) << "it counts as deviation meanwhile";
  next_beat();
  EXPECT_EQ(choice.belief().settings.law, PhaseLaw::kWarped);
}

}  // namespace
}  // namespace perimap
