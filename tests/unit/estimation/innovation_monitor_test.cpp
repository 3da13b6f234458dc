#include "core/estimation/innovation_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
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

// As often above a limit of two of its standard deviations, whatever the updates of a cycle have in common.
TEST(InnovationMonitor, ItsLimitsAreAsWideAsItsMeanScatters) {
  for (const double common : {0.0, 0.5, 1.0}) {
    std::mt19937 generator(4);
    std::normal_distribution<double> normal;
    constexpr double kMemory = 600.0;
    InnovationMonitor monitor({.memory_updates = kMemory, .largest_nis = 100.0});
    const double limit = 1.0 + 2.0 / std::sqrt(2.0 * kMemory - 1.0);
    constexpr int kUpdates = 600'000;
    int above = 0;
    for (int i = 0; i < kUpdates;) {
      monitor.begin_cycle();
      const double shared = normal(generator);
      for (const int end = i + 15; i < end; ++i) {
        const double along = std::sqrt(common) * shared + std::sqrt(1.0 - common) * normal(generator);
        monitor.add(along * along + std::pow(normal(generator), 2), common);
        above += monitor.above(limit) ? 1 : 0;
      }
    }
    EXPECT_NEAR(static_cast<double>(above) / kUpdates, 0.027, 0.012) << common;
  }
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
