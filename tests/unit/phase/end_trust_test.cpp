#include "core/phase/end_trust.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <random>

namespace perimap {
namespace {

using std::chrono::milliseconds;

// Cycles of which the images foretell the end halfway, and then the R peak comes.
struct Ends : ::testing::Test {
  EndTrust trust;
  Instant predicted = from_ns(5'000'000'000);
  std::mt19937 generator{3};
  static constexpr double kDeviation_s = 0.005;

  void cycle(double moved_s, double late_s, double deviation_s = kDeviation_s) {
    predicted += milliseconds(800);
    trust.foretell({predicted, from_seconds(deviation_s), from_seconds(moved_s)}, 0.6);
    trust.score(predicted + from_seconds(late_s));
  }
  // In a cycle predicted as those that were scored.
  [[nodiscard]] double weight(double sensitivity) const {
    return trust.weight(sensitivity, kDeviation_s * kDeviation_s);
  }
  [[nodiscard]] double scatter(double deviation_s) {
    return std::normal_distribution<double>(0.0, deviation_s)(generator);
  }
  // The images see the truth but for an error; so much of what they foretell comes true on the average.
  void cycles(int n, double true_s, double error_s, double deviation_s = kDeviation_s) {
    for (int i = 0; i < n; ++i) {
      const double late_s = scatter(true_s);
      cycle(late_s + scatter(error_s), late_s, deviation_s);
    }
  }
};

TEST_F(Ends, AreBelievedBeforeAnythingIsKnown) { EXPECT_EQ(weight(0.5), 1.0); }

TEST_F(Ends, ThatComeTrueAreBelieved) {
  cycles(100, kDeviation_s, 0.0);
  EXPECT_NEAR(weight(0.5), 1.0, 1e-6);
}

TEST_F(Ends, ThatAreNoiseCountLittle) {
  cycles(100, 0.001, 0.02);
  EXPECT_LT(weight(0.5), 0.1);
}

TEST_F(Ends, CountByTheShareOfTruthInThem) {
  double sum = 0.0;
  for (int i = 0; i < 200; ++i) {
    trust = {};
    cycles(200, kDeviation_s, kDeviation_s);
    sum += weight(0.5);
  }
  EXPECT_NEAR(sum / 200, 0.5, 0.03);
}

TEST_F(Ends, CountMoreTheShorterTheLever) {
  cycles(100, 0.01, 0.02);
  double before = weight(0.3);
  EXPECT_EQ(weight(0.5), before) << "with a longer lever than 1 as with 1";
  EXPECT_LT(before, 0.5);
  for (const double sensitivity : {0.6, 0.7, 0.8, 0.9, 0.99}) {
    EXPECT_GT(weight(sensitivity), before);
    before = weight(sensitivity);
  }
  EXPECT_EQ(weight(1.0), 1.0);
  EXPECT_EQ(weight(1.2), 1.0) << "past the end";
}

TEST_F(Ends, ThatGoTheWrongWayCountForLeastAndNotLess) {
  for (int i = 0; i < 100; ++i) {
    const double late_s = scatter(0.01);
    cycle(-late_s, late_s);
  }
  EXPECT_GT(weight(0.5), 0.0);
  EXPECT_LT(weight(0.5), 0.05);
  EXPECT_EQ(weight(1.0), 1.0);
}

TEST_F(Ends, ThatFallShortCountForNoMoreThanTheySay) {
  for (int i = 0; i < 100; ++i) {
    const double late_s = scatter(0.01);
    cycle(0.5 * late_s, late_s);
  }
  EXPECT_EQ(weight(0.5), 1.0);
}

TEST_F(Ends, OfLongAgoAreForgotten) {
  cycles(100, 0.001, 0.02);
  EXPECT_LT(weight(0.5), 0.1);
  cycles(400, kDeviation_s, 0.1 * kDeviation_s);
  EXPECT_GT(weight(0.5), 0.9);
}

// An error of some milliseconds is nothing beside a pause that is not known to 50, however much it is beside an even
// rhythm.
TEST_F(Ends, AreBelievedAtOnceWhereThePredictionIsUncertain) {
  cycles(100, 0.001, 0.01, 0.001);
  EXPECT_LT(trust.weight(0.5, 0.001 * 0.001), 0.1);
  EXPECT_GT(trust.weight(0.5, 0.05 * 0.05), 0.9);
}

TEST_F(Ends, ABeatFarOffThePredictionCountsAsOneOfFourDeviations) {
  cycles(100, 0.001, 0.02);
  const EndTrust before = trust;
  cycle(0.02, 0.02);
  const double usual = weight(0.5);
  trust = before;
  cycle(0.02, 0.3);
  EXPECT_EQ(weight(0.5), usual);
}

TEST_F(Ends, AreForetoldWhereTheyCanBeAndStillMatter) {
  for (const double sensitivity : {-0.1, 0.0, 0.49, 0.86, 1.0}) {
    trust.foretell({predicted, milliseconds(5), milliseconds(20)}, sensitivity);
    EXPECT_FALSE(trust.foretold()) << sensitivity;
  }
  trust.foretell({predicted, milliseconds(5), milliseconds(20)}, 0.7);
  EXPECT_TRUE(trust.foretold());
}

TEST_F(Ends, TheFirstOfACycleCounts) {
  for (int i = 0; i < 50; ++i) {
    predicted += milliseconds(800);
    trust.foretell({predicted, milliseconds(5), milliseconds(20)}, 0.5);
    trust.foretell({predicted, milliseconds(5), milliseconds(0)}, 0.8);
    trust.score(predicted);
  }
  EXPECT_LT(weight(0.5), 0.1);
}

TEST_F(Ends, OfWhichNothingWasForetoldOrKeptTeachNothing) {
  cycles(100, 0.01, 0.02);
  const double before = weight(0.5);
  trust.score(predicted + milliseconds(100));
  EXPECT_EQ(weight(0.5), before);
  trust.foretell({predicted, milliseconds(5), milliseconds(20)}, 0.5);
  trust.discard();
  trust.score(predicted + milliseconds(100));
  EXPECT_EQ(weight(0.5), before);
}

}  // namespace
}  // namespace perimap
