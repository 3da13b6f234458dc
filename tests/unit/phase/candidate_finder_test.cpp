#include "core/phase/candidate_finder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <vector>

#include "core/phase/ecg_filter.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr double kRate_hz = 1000.0;

struct Found {
  QrsCandidate candidate;
  double told_s = 0.0;
};

// Hears a line from its begin on.
struct Finder {
  Finder() {
    filter.restart(milliseconds(1));
    finder.set_period(milliseconds(1));
    finder.restart();
  }
  void hear(double length_s, const std::function<double(double)>& value_mV) {
    for (const int until = now + static_cast<int>(length_s * kRate_hz); now < until; ++now) {
      filter.push(Instant(now * milliseconds(1)), value_mV(now / kRate_hz), false);
      finder.follow(clusters, Polarity{}, quiet, [&](const QrsCandidate& candidate) {
        found.push_back({candidate, now / kRate_hz});
      });
    }
  }
  // A line of that slope.
  void rise(double length_s, double mV_per_s) {
    hear(length_s, [&](double) { return at_mV += mV_per_s / kRate_hz; });
  }

  CandidateSettings settings;
  EcgFilter filter;
  QrsClusters clusters;
  double quiet = 0.0;
  CandidateFinder finder{settings, filter};
  std::vector<Found> found;
  int now = 0;
  double at_mV = 0.0;
};

double wave(double t_s, double at_s, double sigma_s) {
  const double x = (t_s - at_s) / sigma_s;
  return std::exp(-0.5 * x * x);
}
double qrs(double t_s) { return wave(t_s, 1.0, 0.012); }

// ---- maxima of the energy

TEST(CandidateFinder, AMaximumOfTheEnergyIsTold) {
  Finder ecg;
  ecg.hear(1.5, qrs);
  ASSERT_EQ(ecg.found.size(), 1U);
  EXPECT_NEAR(to_seconds(ecg.found[0].candidate.time.time_since_epoch()), 1.0, 1e-3);
}

// A line that rises ever a little faster, then slower or not at all for a while, then far faster: how many maxima.
std::size_t maxima_about(double slower, double for_s, double faster) {
  Finder ecg;
  ecg.rise(0.3, 0.0);
  for (int i = 0; i < 300; ++i) ecg.rise(0.001, 9.7 + 0.001 * i);
  ecg.rise(for_s, 10.0 * slower);
  ecg.rise(0.15, 10.0 * faster);
  ecg.rise(0.5, 0.0);
  return ecg.found.size();
}

TEST(CandidateFinder, AMaximumIsOneWhenNothingExceededItForFiftyMilliseconds) {
  EXPECT_EQ(maxima_about(0.8, 0.032, 1.4), 1U) << "exceeded after 45 ms";
  EXPECT_EQ(maxima_about(0.8, 0.044, 1.4), 2U) << "and after 60";
}

TEST(CandidateFinder, AFallToThreeQuartersMakesAMaximumAtOnceAndAShallowOneDoesNot) {
  EXPECT_EQ(maxima_about(0.0, 0.016, 4.0), 1U);
  EXPECT_EQ(maxima_about(0.0, 0.026, 4.0), 2U);
}

// A second rise, to so many times the trough.
std::size_t maxima(double times) {
  Finder ecg;
  ecg.rise(0.3, 0.0);
  ecg.rise(0.15, 10.0);
  ecg.rise(0.3, 4.0);
  ecg.rise(0.15, 4.0 * times);
  ecg.rise(0.3, 4.0);
  return ecg.found.size();
}

TEST(CandidateFinder, ARippleIsNoNewMaximum) {
  EXPECT_EQ(maxima(1.3), 1U);
  EXPECT_EQ(maxima(1.75), 2U);
}

// ---- what is too small

TEST(CandidateFinder, WhatHardlyExceedsTheQuietLevelIsNone) {
  const auto told = [](double times) {
    Finder measured;
    measured.hear(1.5, qrs);
    Finder ecg;
    ecg.quiet = measured.found.at(0).candidate.energy / times;
    ecg.hear(1.5, qrs);
    return ecg.found.size();
  };
  EXPECT_EQ(told(1.1), 0U);
  EXPECT_EQ(told(1.35), 1U);
}

TEST(CandidateFinder, AStepOfTheConverterIsNone) {
  const auto told = [](double times) {
    Finder ecg;
    const double quantum = 0.01;
    Finder exact;
    exact.hear(1.5, qrs);
    const double height = times * quantum / exact.found.at(0).candidate.energy;
    ecg.hear(1.5, [&](double t_s) { return quantum * std::round(height * qrs(t_s) / quantum); });
    return ecg.found.size();
  };
  EXPECT_EQ(told(1.65), 0U);
  EXPECT_EQ(told(2.4), 1U);
}

// ---- fits

// A cluster of beats is known, and no energy is large enough beside the quiet level.
struct Fitting : Finder {
  Fitting() {
    Finder before;
    before.hear(1.5, qrs);
    const QrsShape shape = before.found.at(0).candidate.shape;
    for (int i = 0; i < 10; ++i) clusters.judged(clusters.learn(shape, true, Surroundings::kCalm, Instant{}), 3.0);
    quiet = 1e6;
  }
};

TEST(CandidateFinder, WhatIsLikeTheBeatsIsACandidateHoweverSmallItIs) {
  Fitting ecg;
  ecg.hear(1.5, [](double t_s) { return 0.5 * qrs(t_s); });
  ASSERT_EQ(ecg.found.size(), 1U);
  EXPECT_NEAR(to_seconds(ecg.found[0].candidate.time.time_since_epoch()), 1.0, 2e-3);
}

// Three steps of the shape after the best.
TEST(CandidateFinder, AFitIsToldWhenItIsSeenToHaveBeenTheBest) {
  Fitting ecg;
  ecg.hear(1.5, [](double t_s) { return 0.5 * qrs(t_s); });
  ASSERT_EQ(ecg.found.size(), 1U);
  const double shape_s = 0.045;
  EXPECT_NEAR(ecg.found[0].told_s, 1.0 + ecg.filter.slope_delay() / kRate_hz + shape_s + 0.015, 0.003);
}

TEST(CandidateFinder, AWaveOfAnotherWidthIsLessAlike) {
  const auto told = [](double sigma_s, double& correlation) {
    Fitting ecg;
    ecg.hear(1.5, [=](double t_s) { return wave(t_s, 1.0, sigma_s); });
    Finder alone;
    alone.hear(1.5, [=](double t_s) { return wave(t_s, 1.0, sigma_s); });
    correlation = 0.0;
    for (const Found& found : alone.found)
      correlation = std::max(correlation, ecg.clusters.nearest_beat(found.candidate.shape).correlation);
    return ecg.found.size();
  };
  double correlation = 0.0;
  EXPECT_EQ(told(0.035, correlation), 1U);
  EXPECT_LT(correlation, 0.75);
  EXPECT_EQ(told(0.050, correlation), 0U);
  EXPECT_GT(correlation, 0.45);
}

}  // namespace
}  // namespace perimap
