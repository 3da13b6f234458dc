#include "core/tool/tip_track.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace perimap {
namespace {

constexpr Instant kStart{std::chrono::seconds(100)};
constexpr double kPeriod_s = 0.01;
const Vector3d kTip_O_mm(3.0, -2.0, -118.0);

Instant at(double t_s) { return kStart + from_seconds(t_s); }

PoseHistorySettings tracker(double position_rms_mm, double rotation_rms_rad = 0.0) {
  PoseHistorySettings settings;
  settings.position_deviation_mm = position_rms_mm / std::numbers::sqrt3;
  settings.rotation_deviation_rad = rotation_rms_rad / std::numbers::sqrt3;
  return settings;
}

// Of a tool whose tip is at `tip`, with noise on its own pose.
TrackerSample reading(double t_s, const Vector3d& tip, const PoseHistorySettings& noise, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const auto drawn = [&] { return Vector3d(normal(random), normal(random), normal(random)); };
  TrackerSample sample;
  sample.source_time = at(t_s);
  sample.state = ToolState::kOk;
  const Matrix3d R = so3_exp(Vector3d(0.3, 0.2, t_s));
  sample.X_WS.t = tip - R * kTip_O_mm + noise.position_deviation_mm * drawn();
  sample.X_WS.R = R * so3_exp(noise.rotation_deviation_rad * drawn());
  return sample;
}

// What a hand does: comes, rests, goes.
Vector3d hand(double t_s) {
  const double s = std::sin(std::numbers::pi * t_s);
  return {20.0 * s * s, 10.0 * std::sin(2.0 * t_s), 5.0 * std::cos(3.0 * t_s)};
}

struct Score {
  double squares = 0.0, nees = 0.0;
  int count = 0;
  [[nodiscard]] double rms() const { return std::sqrt(squares / count); }
  [[nodiscard]] double mean_nees() const { return nees / count / 3.0; }
};

template <class Path>
Score score(const Path& path, const PoseHistorySettings& noise, double ahead_s, unsigned seed) {
  std::mt19937_64 random(seed);
  TipTrack track(noise, {kTip_O_mm, Matrix3d::Zero()});
  Score score;
  for (int k = 0; k < 2000; ++k) {
    const double t = k * kPeriod_s;
    track.add(reading(t, path(t), noise, random));
    if (k < 100) continue;
    const auto tip = track.at(at(t + ahead_s));
    const Vector3d error = tip->p_WT_mm - path(t + ahead_s);
    score.squares += error.squaredNorm();
    score.nees += error.dot(tip->covariance_W_mm2.llt().solve(error));
    ++score.count;
  }
  return score;
}

TEST(TipTrack, SaysNothingBeforeTheFirstReading) {
  const TipTrack track(tracker(1.0), {kTip_O_mm, Matrix3d::Zero()});
  EXPECT_FALSE(track.at(at(1.0)));
  EXPECT_FALSE(track.last_seen());
}

TEST(TipTrack, IsWhereAnExactTrackerHasTheTip) {
  const Score moved = score(hand, tracker(0.0), 0.015, 1);
  EXPECT_LT(moved.rms(), 0.1);
  EXPECT_LT(moved.mean_nees(), 1.5);
}

TEST(TipTrack, AveragesAToolThatRests) {
  const Score still = score([](double) { return Vector3d(1.0, 2.0, 3.0); }, tracker(1.4), 0.015, 2);
  EXPECT_LT(still.rms(), 0.5 * 1.4);
}

TEST(TipTrack, ItsDeviationIsRightWhileTheHandMovesAndRests) {
  for (const unsigned seed : {3U, 4U, 5U}) {
    const Score moved = score(hand, tracker(1.4, 0.5 * std::numbers::pi / 180.0), 0.015, seed);
    EXPECT_GT(moved.mean_nees(), 0.4) << seed;
    EXPECT_LT(moved.mean_nees(), 1.4) << seed;
    const Score still = score([](double) { return Vector3d(0.0, 0.0, 0.0); }, tracker(1.4), 0.015, seed);
    EXPECT_GT(still.mean_nees(), 0.4) << seed;
    EXPECT_LT(still.mean_nees(), 1.4) << seed;
  }
}

TEST(TipTrack, ItsDeviationCoversWhatTheHandDoesIn300Milliseconds) {
  const Score moved = score(hand, tracker(1.4), 0.3, 6);
  EXPECT_LT(moved.mean_nees(), 1.5);
}

TEST(TipTrack, TheRotationsNoiseCountsByTheLever) {
  std::mt19937_64 random(7);
  const PoseHistorySettings noise = tracker(0.1, 1.0 * std::numbers::pi / 180.0);
  TipTrack track(noise, {kTip_O_mm, Matrix3d::Zero()});
  track.add(reading(0.0, Vector3d::Zero(), noise, random));
  const Matrix3d P = track.at(at(0.0))->covariance_W_mm2;
  const double across_mm = noise.rotation_deviation_rad * kTip_O_mm.norm();
  EXPECT_NEAR(std::sqrt(P.diagonal().sum()), std::sqrt(2.0) * across_mm, 0.2 * across_mm);
}

TEST(TipTrack, TheCalibrationsCovarianceTurnsWithTheTool) {
  TipInTool tip{kTip_O_mm, Matrix3d::Zero()};
  tip.covariance_O_mm2(2, 2) = 4.0;  // along the tool
  TipTrack track(tracker(0.0), tip);
  TrackerSample sample;
  sample.source_time = at(0.0);
  sample.state = ToolState::kOk;
  sample.X_WS.R = so3_exp(Vector3d(0.0, 0.5 * std::numbers::pi, 0.0));  // the tool's z is W's x
  track.add(sample);
  const Matrix3d P = track.at(at(0.0))->covariance_W_mm2;
  EXPECT_NEAR(P(0, 0), 4.0, 0.01);
  EXPECT_NEAR(P(2, 2), 0.0, 0.01);
}

TEST(TipTrack, WhatIsRepeatedBitForBitIsNoReading) {
  std::mt19937_64 random(8);
  TipTrack track(tracker(1.0), {kTip_O_mm, Matrix3d::Zero()});
  TrackerSample sample = reading(0.0, Vector3d::Zero(), tracker(1.0), random);
  track.add(sample);
  sample.source_time = at(0.5);
  track.add(sample);
  EXPECT_EQ(track.last_seen(), at(0.0));
}

TEST(TipTrack, AnExactTrackersReadingsMayBeAlike) {
  std::mt19937_64 random(8);
  TipTrack track(tracker(0.0), {kTip_O_mm, Matrix3d::Zero()});
  TrackerSample sample = reading(0.0, Vector3d::Zero(), tracker(0.0), random);
  track.add(sample);
  sample.source_time = at(0.01);
  track.add(sample);
  EXPECT_EQ(track.last_seen(), at(0.01));
}

TEST(TipTrack, AnErrorThatLastsIsNotAveragedAway) {
  PoseHistorySettings noise = tracker(1.4);
  noise.error_correlation = std::chrono::seconds(5);
  std::mt19937_64 random(9);
  TipTrack track(noise, {kTip_O_mm, Matrix3d::Zero()});
  for (int k = 0; k < 500; ++k) track.add(reading(k * kPeriod_s, Vector3d::Zero(), noise, random));
  const double variance = noise.position_deviation_mm * noise.position_deviation_mm;
  EXPECT_GE(track.at(at(5.0))->covariance_W_mm2.diagonal().minCoeff(), variance);
}

TEST(TipTrack, PassesOverWhatIsOldAndWhatIsNoNumber) {
  std::mt19937_64 random(10);
  const PoseHistorySettings noise = tracker(0.5);
  TipTrack track(noise, {kTip_O_mm, Matrix3d::Zero()});
  track.add(reading(1.0, Vector3d::Zero(), noise, random));
  const TipPrediction before = *track.at(at(1.0));
  track.add(reading(0.9, Vector3d(50.0, 0.0, 0.0), noise, random));
  TrackerSample none = reading(1.1, Vector3d::Zero(), noise, random);
  none.X_WS.t.x() = std::numeric_limits<double>::quiet_NaN();
  track.add(none);
  none.X_WS.t.x() = std::numeric_limits<double>::infinity();
  none.source_time = at(1.2);
  track.add(none);
  EXPECT_EQ(track.last_seen(), at(1.0));
  EXPECT_EQ(track.at(at(1.0))->p_WT_mm, before.p_WT_mm);
}

TEST(TipTrack, IsLostFromSightWhenTheTrackerSaysSo) {
  std::mt19937_64 random(11);
  TipTrack track(tracker(0.5), {kTip_O_mm, Matrix3d::Zero()});
  track.add(reading(0.0, Vector3d::Zero(), tracker(0.5), random));
  EXPECT_FALSE(track.lost_sight());
  TrackerSample missing;
  missing.source_time = at(0.01);
  track.add(missing);
  EXPECT_TRUE(track.lost_sight());
  EXPECT_EQ(track.last_seen(), at(0.0));
}

TEST(TipTrack, BeginsAnewAfterAGap) {
  std::mt19937_64 random(12);
  const PoseHistorySettings noise = tracker(0.5);
  TipTrack track(noise, {kTip_O_mm, Matrix3d::Zero()});
  for (int k = 0; k < 100; ++k) track.add(reading(k * kPeriod_s, Vector3d::Zero(), noise, random));
  const Vector3d elsewhere(80.0, 0.0, 0.0);
  track.add(reading(3.0, elsewhere, noise, random));
  EXPECT_LT((track.at(at(3.0))->p_WT_mm - elsewhere).norm(), 2.0);
}

}  // namespace
}  // namespace perimap
