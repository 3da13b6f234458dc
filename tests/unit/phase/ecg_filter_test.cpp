#include "core/phase/ecg_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>

namespace perimap {
namespace {

using std::chrono::milliseconds;

// A line through the filter; `each` sees it after every sample.
struct Filtered {
  Filtered(
      double rate_hz, double length_s, const std::function<double(int)>& value_mV,
      const std::function<void(const EcgSample&)>& each = [](const EcgSample&) {}) {
    const Duration period = from_seconds(1.0 / rate_hz);
    filter.restart(period);
    for (int i = 0; i < static_cast<int>(length_s * rate_hz); ++i) {
      filter.push(Instant(i * period), value_mV(i), false);
      each(filter.at(filter.now()));
    }
  }
  [[nodiscard]] double despiked(int i) const { return filter.at(i + filter.despiked_delay()).despiked; }
  EcgFilter filter;
};

// `samples` of 1 mV.
std::function<double(int)> pulse(int samples) {
  return [=](int i) { return i >= 100 && i < 100 + samples ? 1.0 : 0.0; };
}

TEST(EcgFilter, APacingSpikeOfFourMillisecondsIsRemovedAndAWaveOfSixIsNot) {
  EXPECT_EQ(Filtered(500.0, 0.4, pulse(2)).despiked(101), 0.0);
  EXPECT_EQ(Filtered(500.0, 0.4, pulse(3)).despiked(101), 1.0);
  EXPECT_EQ(Filtered(1000.0, 0.4, pulse(4)).despiked(102), 0.0);
}

// A median over three samples takes whatever is highest alone.
TEST(EcgFilter, WhereSamplesAreFewTheTipOfAnRWaveStays) {
  const auto tip = [](int i) { return i == 100 ? 1.0 : i == 99 || i == 101 ? 0.6 : i == 98 || i == 102 ? 0.1 : 0.0; };
  EXPECT_EQ(Filtered(200.0, 1.0, tip).despiked(100), 1.0);
  EXPECT_EQ(Filtered(250.0, 1.0, tip).despiked(100), 0.6);
}

TEST(EcgFilter, WhereSamplesAreFewASpikeIsWhatStandsOutByTwiceWhatItsNeighboursDiffer) {
  const auto height = [](double mV) {
    return [=](int i) { return i == 100 ? mV : i >= 98 && i < 103 ? 0.1 * (i - 100) : 0.0; };
  };
  const double least = 0.2;  // of the highest neighbour, which are 0.4 mV apart
  EXPECT_NEAR(Filtered(200.0, 1.0, height(least + 0.4 * 1.7)).despiked(100), least + 0.4 * 1.7, 1e-9);
  EXPECT_NEAR(Filtered(200.0, 1.0, height(least + 0.4 * 2.4)).despiked(100), 0.0, 1e-9);
}

TEST(EcgFilter, TwoSamplesToEachSideTellASpikeWhereTheyAreFew) {
  const auto on_last_bits = [](int samples) {
    return [=](int i) { return pulse(samples)(i) + (i % 2 == 0 ? 0.0 : 0.01); };
  };
  const Filtered slow(200.0, 1.0, on_last_bits(1));
  EXPECT_EQ(slow.filter.despiked_delay(), 2);
  EXPECT_NEAR(slow.despiked(100), 0.0, 0.02);
  EXPECT_NEAR(Filtered(200.0, 1.0, on_last_bits(2)).despiked(100), 1.0, 0.02) << "another as high is beside it";
}

TEST(EcgFilter, MainsOfFiftyHertzAreNoSlope) {
  double most = 0.0;
  const Filtered hum(
      500.0, 1.0, [](int i) { return std::sin(2.0 * std::numbers::pi * 50.0 * i / 500.0 + 0.3); },
      [&](const EcgSample& sample) {
        if (to_seconds(sample.time.time_since_epoch()) > 0.3) most = std::max(most, std::abs(sample.slope));
      });
  EXPECT_LT(most, 0.002);
}

// The rise of 1 mV in 20 ms, as a mean over 80 ms.
TEST(EcgFilter, TheEnergyIsAMeanOverAQrsComplex) {
  double most = 0.0;
  const Filtered step(
      500.0, 1.0, [](int i) { return i < 200 ? 0.0 : 1.0; },
      [&](const EcgSample& sample) { most = std::max(most, sample.energy); });
  EXPECT_NEAR(most, 0.25, 0.01);
}

TEST(EcgFilter, AllOutputsAreAsLateAsTheySay) {
  const auto bump = [](int i) { return std::exp(-0.5 * std::pow((i - 200) / 10.0, 2)); };
  const Filtered filtered(500.0, 1.0, bump);
  const auto middle = [&](auto&& of) {
    double sum = 0.0;
    double weighted = 0.0;
    for (int i = 0; i <= filtered.filter.now(); ++i) {
      const double value = std::abs(of(filtered.filter.at(i)));
      sum += value;
      weighted += value * i;
    }
    return weighted / sum - 200.0;
  };
  EXPECT_NEAR(middle([](const EcgSample& s) { return s.despiked; }), filtered.filter.despiked_delay(), 1.0);
  EXPECT_NEAR(middle([](const EcgSample& s) { return s.smooth; }), filtered.filter.smooth_delay(), 1.0);
  EXPECT_NEAR(middle([](const EcgSample& s) { return s.slope; }), filtered.filter.slope_delay(), 1.0);
  EXPECT_NEAR(middle([](const EcgSample& s) { return s.energy; }), filtered.filter.energy_delay(), 1.0);
  EXPECT_NEAR(middle([](const EcgSample& s) { return s.sharpness; }), filtered.filter.sharpness_delay(), 1.0);
}

}  // namespace
}  // namespace perimap
