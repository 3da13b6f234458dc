#include "core/phase/beat_path.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace perimap {
namespace {

// Of each candidate, by going through all sets of candidates.
template <class LogOdds, class Waited>
std::array<double, BeatPath::kMost> by_enumeration(int count, LogOdds&& log_odds, Waited&& waited) {
  std::array<double, BeatPath::kMost> with{};
  double total = 0.0;
  for (unsigned set = 0; set < 1U << count; ++set) {
    double weight = 1.0;
    int last = -1;
    for (int i = 0; i < count; ++i) {
      if ((set >> i & 1U) == 0) continue;
      weight *= std::exp(log_odds(last, i));
      last = i;
    }
    weight *= waited(last);
    total += weight;
    for (int i = 0; i < count; ++i) {
      if ((set >> i & 1U) != 0) with[static_cast<std::size_t>(i)] += weight;
    }
  }
  for (double& weight : with) weight /= total;
  return with;
}

TEST(BeatPath, ProbabilitiesAreThoseOfAllSetsOfCandidates) {
  std::mt19937_64 generator(0x9d3f17a2c4b85e61U);
  std::normal_distribution<double> normal(0.0, 2.0);
  std::uniform_real_distribution<double> uniform(0.05, 1.0);
  for (int trial = 0; trial < 50; ++trial) {
    const int count = 1 + trial % 8;
    std::array<std::array<double, 9>, 9> odds{};
    std::array<double, 9> waits{};
    for (auto& row : odds) {
      for (double& value : row) value = normal(generator);
    }
    for (double& value : waits) value = uniform(generator);
    const auto log_odds = [&](int before, int candidate) {
      return odds[static_cast<std::size_t>(before + 1)][static_cast<std::size_t>(candidate)];
    };
    const auto waited = [&](int last) { return waits[static_cast<std::size_t>(last + 1)]; };
    BeatPath path;
    path.weigh(count, log_odds, waited);
    const auto expected = by_enumeration(count, log_odds, waited);
    for (int i = 0; i < count; ++i) {
      EXPECT_NEAR(path.probability(i), expected[static_cast<std::size_t>(i)], 1e-12) << trial;
    }
  }
}

TEST(RhythmModel, ExpectsTheUsualIntervalMost) {
  const RhythmModel rhythm{.cycle_s = 0.8, .spread = 0.08};
  EXPECT_GT(rhythm.log_density(0.8), rhythm.log_density(0.7));
  EXPECT_GT(rhythm.log_density(0.8), rhythm.log_density(0.9));
  EXPECT_GT(rhythm.log_density(0.8), 0.7) << "to an interval without rhythm";
  EXPECT_LT(rhythm.log_density(0.6), -1.0);
}

TEST(RhythmModel, AllButExcludesWhatIsSoonerThanVentriclesContract) {
  const RhythmModel rhythm{.cycle_s = 0.8, .spread = 0.08};
  EXPECT_LT(rhythm.log_density(0.15), -10.0);
  EXPECT_LT(rhythm.log_density(0.22), rhythm.log_density(0.35) - 2.0);
}

TEST(RhythmModel, ItBecomesUnlikelyThatNoBeatHasCome) {
  const RhythmModel rhythm{.cycle_s = 0.8, .spread = 0.08};
  EXPECT_EQ(rhythm.survival(-0.1), 1.0);
  EXPECT_GT(rhythm.survival(0.6), 0.8);
  EXPECT_LT(rhythm.survival(1.1), 0.2);
  EXPECT_GT(rhythm.survival(60.0), 0.0) << "beats may stay away";
  double before = 1.0;
  for (double since_s = 0.1; since_s < 3.0; since_s += 0.1) {
    EXPECT_LE(rhythm.survival(since_s), before);
    before = rhythm.survival(since_s);
  }
}

// ---- the renewal model: four beats of five come in rhythm, the others whenever they like

TEST(RhythmModel, OneBeatOfFiveComesWheneverItLikes) {
  const RhythmModel rhythm{.cycle_s = 0.8, .spread = 0.08};
  EXPECT_NEAR(rhythm.log_density(1.6), std::log(0.2), 0.1) << "far from the rhythm";
  const double peak = 0.8 / (0.08 * std::sqrt(2.0 * std::numbers::pi)) * 2.0;
  EXPECT_NEAR(rhythm.log_density(0.8), std::log(0.2 + peak), 0.1) << "in it, to intervals over two natural units";
}

TEST(RhythmModel, VentriclesAreRefractoryAndThenRecover) {
  const RhythmModel any;
  EXPECT_NEAR(any.log_density(0.17), -12.0, 1.0);
  EXPECT_GT(any.log_density(0.19), -7.0);
  EXPECT_NEAR(any.log_density(0.26), 2.0 * std::log(0.5), 0.1) << "half recovered";
  EXPECT_LT(any.log_density(0.32), -0.2);
  EXPECT_EQ(any.log_density(0.36), 0.0) << "excitable as at any time";
  const RhythmModel slow{.cycle_s = 2.0, .spread = 0.08};
  EXPECT_NEAR(slow.log_density(0.26) - slow.log_density(0.5), 2.0 * std::log(0.5), 0.1);
}

TEST(RhythmModel, WhileNoCycleIsKnownItIsSomeEightTenthsOfASecond) {
  const RhythmModel any;
  EXPECT_NEAR(any.survival(0.8), 0.8 * 0.5 + 0.2 * 0.5, 0.01);
  EXPECT_NEAR(any.survival(0.8 * std::exp(0.35)), 0.8 * 0.159 + 0.2 * (0.5 - 0.35 / 2.0), 0.02);
}

TEST(RhythmModel, WaitingEndsInSlowlyAndNeverForGood) {
  const RhythmModel rhythm{.cycle_s = 0.8, .spread = 0.08};
  EXPECT_NEAR(rhythm.survival(0.8 * std::exp(0.5)), 0.2 * 0.25, 0.005);
  EXPECT_NEAR(rhythm.survival(30.0), 0.03, 0.005);
}

}  // namespace
}  // namespace perimap
