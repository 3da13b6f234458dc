#include "daemon/evaluation/traces/trace_prediction.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "daemon/evaluation/traces/cycle_lengths.hpp"
#include "made_trace.hpp"

namespace perimap::test {
namespace {

const Eigen::VectorXd kNoise = (Eigen::VectorXd(6) << 0.1, 0.1, 0.25, 0.1, 0.1, 0.25).finished();

TEST(VectorAutoregression, ContinuesWhatObeysARecursion) {
  Eigen::MatrixXd samples(200, 2);
  for (int i = 0; i < 200; ++i) samples.row(i) << std::cos(0.3 * i), std::sin(0.3 * i) + 0.5 * std::cos(0.7 * i);
  const VectorAutoregression fitted({.lags = 6, .ridge = 1e-9}, samples.topRows(150), Eigen::Vector2d(1.0, 1.0));
  const Eigen::MatrixXd next = fitted.predict(samples.topRows(150), 20);
  EXPECT_LT((next - samples.middleRows(150, 20)).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(VectorAutoregression, ItsRidgeIsInUnitsOfNoise) {
  Eigen::MatrixXd samples(100, 1);
  for (int i = 0; i < 100; ++i) samples(i, 0) = std::cos(0.3 * i);
  const auto next = [&](double noise) {
    return VectorAutoregression({.lags = 4, .ridge = 10.0}, samples, Eigen::VectorXd::Constant(1, noise))
        .predict(samples, 1)(0, 0);
  };
  const double truth = std::cos(0.3 * 100);
  EXPECT_LT(std::abs(next(0.01) - truth), 0.01);
  EXPECT_GT(std::abs(next(1.0) - truth), 0.03);
}

TEST(TwoPhaseMap, FindsTheMotionItWasGiven) {
  const auto made = made_trace(1, 400, 0.9, 0.0, 0.0);
  const auto& trace = made.trace;
  PhaseTracks tracks = steady_tracks({1.0 / 0.9, 0.2}, trace.period_s, trace.samples());
  const TwoPhaseMap map({.ridge = 1e-6, .product_ridge = 1e-6}, trace.positions, trace.period_s, tracks);
  for (const int i : {10, 200, 399}) {
    EXPECT_LT((map.at(tracks.cardiac[i], tracks.respiratory[i]) - trace.positions.row(i)).norm(), 1e-3);
  }
  const double h = 1e-6;
  const auto slopes = map.slopes(1.0, 2.0);
  EXPECT_LT(((map.at(1.0 + h, 2.0) - map.at(1.0 - h, 2.0)) / (2 * h) - slopes.along_cardiac).norm(), 1e-6);
  EXPECT_LT(((map.at(1.0, 2.0 + h) - map.at(1.0, 2.0 - h)) / (2 * h) - slopes.along_respiratory).norm(), 1e-6);
}

TEST(FindRates, AreThoseOfHeartAndBreathing) {
  const auto made = made_trace(2, 300, 0.9, 0.02, 0.1);
  const PhaseRates rates = find_rates(made.trace.positions, made.trace.period_s, kNoise);
  EXPECT_NEAR(rates.cardiac_hz, 1.0 / 0.9, 0.02);
  EXPECT_NEAR(rates.respiratory_hz, 0.2, 0.015);
}

// The map of motion whose cycles differ, by the phases that the motion tells.
TEST(SmoothPhases, FollowAHeartWhoseCyclesDiffer) {
  const auto made = made_trace(3, 400, 0.9, 0.04, 0.1);
  const auto& trace = made.trace;
  PhaseTracks tracks =
      steady_tracks(find_rates(trace.positions, trace.period_s, kNoise), trace.period_s, trace.samples());
  const auto variance = [&] { return TwoPhaseMap({}, trace.positions, trace.period_s, tracks).variance().sum(); };
  const double steady = variance();
  for (int i = 0; i < 25; ++i) {
    smooth_phases({}, TwoPhaseMap({}, trace.positions, trace.period_s, tracks), trace.positions, trace.period_s, false,
                  tracks);
  }
  EXPECT_LT(variance(), 0.35 * steady);
  const Eigen::VectorXd cardiac = tracks.cardiac;
  smooth_phases({}, TwoPhaseMap({}, trace.positions, trace.period_s, tracks), trace.positions, trace.period_s, true,
                tracks);
  EXPECT_EQ(tracks.cardiac, cardiac) << "where it is known";
}

TEST(CycleLengths, APhaseIsAMultipleOfTwoPiAtEachPeakAndGrows) {
  for (const double systole_s : {0.0, 0.5}) {
    const CycleLengths cycles({0.2, 1.1, 2.1, 2.9}, 3.2, systole_s);
    for (int k = 0; k < 4; ++k) {
      EXPECT_NEAR(cycles.phase(std::vector{0.2, 1.1, 2.1, 2.9}[static_cast<std::size_t>(k)], 0.9), kTwoPi * k, 1e-9);
    }
    double last = cycles.phase(0.0, 0.9);
    for (double t = 0.01; t < 5.0; t += 0.01) {
      const double phase = cycles.phase(t, 0.9);
      EXPECT_GT(phase, last);
      last = phase;
    }
  }
}

TEST(CycleLengths, ACycleThatRunsIsNoShorterThanItHasLasted) {
  const CycleLengths cycles({0.0, 0.9, 1.8, 2.7, 3.6}, 3.6 + 0.95, 0.5);
  double sum = 0.0;
  for (const auto& candidate : cycles.candidates()) {
    EXPECT_GT(candidate.length_s, 0.95);
    sum += candidate.weight;
  }
  EXPECT_NEAR(sum, 1.0, 1e-9);
  const CycleLengths pause({0.0, 0.9, 1.8}, 9.0, 0.5);
  ASSERT_EQ(pause.candidates().size(), 1U);
  EXPECT_GT(pause.candidates().front().length_s, 7.2);
}

TEST(RPeakPrediction, APeakIsKnownATenthOfASecondAfterIt) {
  auto made = made_trace(4, 300, 0.9, 0.03, 0.1);
  for (double& peak_s : made.r_peaks_s) peak_s -= made.trace.first_s;
  const auto predicted = [&](std::vector<double> peaks_s) {
    RPeakPrediction prediction({}, made.trace.period_s, {1.0 / 0.9, 0.2}, kNoise, std::move(peaks_s));
    return prediction.predict(made.trace.positions, {1, 10})->with_residual;
  };
  const double now_s = 299 * 0.04;
  std::vector<double> known;
  for (const double peak_s : made.r_peaks_s) {
    if (peak_s < now_s - 0.5) known.push_back(peak_s);
  }
  auto with_newer = known;
  with_newer.push_back(now_s - 0.09);
  auto with_older = known;
  with_older.push_back(now_s - 0.11);
  EXPECT_EQ(predicted(known), predicted(with_newer));
  EXPECT_NE(predicted(known), predicted(with_older));
  known.resize(2);
  RPeakPrediction few({}, made.trace.period_s, {1.0 / 0.9, 0.2}, kNoise, known);
  EXPECT_FALSE(few.predict(made.trace.positions, {1})) << "with two peaks no cycle is usual";
}

}  // namespace
}  // namespace perimap::test
