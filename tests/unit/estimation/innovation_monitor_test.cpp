#include "core/estimation/innovation_monitor.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace perimap {
namespace {

// NIS of a filter whose innovations are `scale` times as wide as it believes.
double draw_nis(std::mt19937& generator, double scale = 1.0) {
  std::normal_distribution<double> normal(0.0, scale);
  const double a = normal(generator);
  const double b = normal(generator);
  return a * a + b * b;
}

TEST(InnovationMonitor, GivesNoVerdictAtFirst) {
  InnovationMonitor monitor;
  EXPECT_EQ(monitor.verdict(), InnovationVerdict::kTooFew);
  for (int i = 0; i < 19; ++i) monitor.add(2.0);
  EXPECT_EQ(monitor.verdict(), InnovationVerdict::kTooFew);
  EXPECT_FALSE(monitor.consistent());
  monitor.add(2.0);
  EXPECT_TRUE(monitor.consistent());
  monitor.reset();
  EXPECT_EQ(monitor.verdict(), InnovationVerdict::kTooFew);
}

TEST(InnovationMonitor, IsThePlainMeanUntilItsMemoryIsFull) {
  InnovationMonitor monitor;
  monitor.add(1.0);
  monitor.add(2.0);
  monitor.add(6.0);
  EXPECT_NEAR(monitor.mean(), 1.5, 1e-15);
}

TEST(InnovationMonitor, CallsAConsistentFilterConsistentAlmostAlways) {
  std::mt19937 generator(1);
  InnovationMonitor monitor;
  int verdicts = 0;
  int inconsistent = 0;
  for (int i = 0; i < 20000; ++i) {
    monitor.add(draw_nis(generator));
    if (monitor.verdict() == InnovationVerdict::kTooFew) continue;
    ++verdicts;
    inconsistent += monitor.consistent() ? 0 : 1;
    EXPECT_FALSE(monitor.high());
  }
  EXPECT_GT(verdicts, 19000);
  EXPECT_LT(inconsistent, verdicts / 500);
}

TEST(InnovationMonitor, NoticesInnovationsTwiceTooWideAndRecovers) {
  std::mt19937 generator(2);
  InnovationMonitor monitor;
  for (int i = 0; i < 100; ++i) monitor.add(draw_nis(generator));
  for (int i = 0; i < 60; ++i) monitor.add(draw_nis(generator, 2.0));
  EXPECT_TRUE(monitor.high());
  for (int i = 0; i < 200; ++i) monitor.add(draw_nis(generator));
  EXPECT_TRUE(monitor.consistent());
}

TEST(InnovationMonitor, OneGrossOutlierIsNotADrift) {
  std::mt19937 generator(3);
  InnovationMonitor monitor;
  for (int i = 0; i < 100; ++i) monitor.add(draw_nis(generator));
  monitor.add(1e12);
  monitor.add(std::numeric_limits<double>::quiet_NaN());
  EXPECT_LT(monitor.mean(), 2.0);
  EXPECT_FALSE(monitor.high());
}

}  // namespace
}  // namespace perimap
