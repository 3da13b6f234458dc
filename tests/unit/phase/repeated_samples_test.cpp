#include "core/phase/repeated_samples.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace perimap {
namespace {

constexpr double kSamples_per_s = 250.0;
constexpr Duration kSampleTime = std::chrono::milliseconds(4);

// A beat each 0.8 s with a noise of 5 uV, in steps of 5 uV as recorders have.
std::vector<float> lead(double seconds, unsigned seed = 1) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise(0.0, 0.005);
  std::vector<float> mV;
  for (int i = 0; i < static_cast<int>(seconds * kSamples_per_s); ++i) {
    const double x = std::remainder(i / kSamples_per_s, 0.8) / 0.012;
    mV.push_back(static_cast<float>(0.005 * std::round((std::exp(-0.5 * x * x) + noise(generator)) / 0.005)));
  }
  return mV;
}

// How many of the samples are told.
int heard(RepeatedSamples& repeated, const std::vector<float>& mV) {
  int told = 0;
  for (const float value : mV) {
    repeated.add(value, kSampleTime);
    told += repeated.told() ? 1 : 0;
  }
  return told;
}

std::vector<float> last(const std::vector<float>& mV, double seconds) {
  return {mV.end() - static_cast<std::ptrdiff_t>(seconds * kSamples_per_s), mV.end()};
}

TEST(RepeatedSamples, OfAPatientAreNone) {
  RepeatedSamples repeated;
  EXPECT_EQ(heard(repeated, lead(120.0)), 0);
  EXPECT_EQ(repeated.count(), 0U);
}

TEST(RepeatedSamples, ThatComeAgainAndAgainAreToldWithinTwoSecondsAndCounted) {
  for (const double length : {0.5, 1.0, 7.3}) {
    RepeatedSamples repeated;
    const std::vector<float> before = lead(20.0);
    ASSERT_EQ(heard(repeated, before), 0);
    const std::vector<float> loop = last(before, length);
    int told = 0;
    int samples = 0;
    for (; samples < static_cast<int>(30.0 * kSamples_per_s); ++samples) {
      repeated.add(loop[static_cast<std::size_t>(samples) % loop.size()], kSampleTime);
      told += repeated.told() ? 1 : 0;
      EXPECT_TRUE(samples < static_cast<int>(2.0 * kSamples_per_s) || repeated.told()) << length;
    }
    EXPECT_GE(told, samples - static_cast<int>(2.0 * kSamples_per_s)) << length;
    EXPECT_GE(repeated.count(), static_cast<std::uint64_t>(told)) << "from where the run began";
    EXPECT_EQ(heard(repeated, lead(10.0, 2)), 0) << "heard again";
  }
}

TEST(RepeatedSamples, OfALineThatStandsStillAreFlatAndNotRepeated) {
  RepeatedSamples repeated;
  EXPECT_EQ(heard(repeated, std::vector<float>(5000, 0.1F)), 0);
}

TEST(RepeatedSamples, ThatWereHeardLongerAgoAreNotKnown) {
  RepeatedSamples repeated;
  const std::vector<float> before = lead(30.0);
  static_cast<void>(heard(repeated, before));
  EXPECT_EQ(heard(repeated, last(before, 30.0)), 0) << "30 s ago";
}

TEST(RepeatedSamples, AreKnownForTwentySecondsAtTwoThousandSamplesASecond) {
  RepeatedSamples repeated;
  std::mt19937 generator(3);
  std::normal_distribution<double> noise(0.0, 0.2);
  std::vector<float> mV(19 * 2000);
  for (float& value : mV) value = static_cast<float>(0.005 * std::round(noise(generator) / 0.005));
  const auto told = [&](std::size_t samples) {
    int count = 0;
    for (std::size_t i = 0; i < samples; ++i) {
      repeated.add(mV[i], std::chrono::microseconds(500));
      count += repeated.told() ? 1 : 0;
    }
    return count;
  };
  ASSERT_EQ(told(mV.size()), 0);
  EXPECT_GT(told(3 * 2000), 1900) << "two seconds of three, from 19 s ago";
}

TEST(RepeatedSamples, AreNoneAcrossWhatIsMissingOrIsNoNumber) {
  RepeatedSamples repeated;
  const std::vector<float> before = lead(5.0);
  static_cast<void>(heard(repeated, before));
  const std::vector<float> loop = last(before, 0.9);
  int told = 0;
  for (int i = 0; i < 10; ++i) {
    told += heard(repeated, loop);
    repeated.add(std::numeric_limits<float>::quiet_NaN(), kSampleTime);
  }
  EXPECT_EQ(told, 0);
  for (int i = 0; i < 10; ++i) {
    told += heard(repeated, loop);
    repeated.interrupt();
  }
  EXPECT_EQ(told, 0);
}

}  // namespace
}  // namespace perimap
