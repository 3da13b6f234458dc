#include "core/estimation/correlated_pose_noise.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

namespace perimap {
namespace {

// A point that is seen from all sides by poses whose errors last two seconds, while one in ten has an error of its own
// besides, five times as large in all; and is told so. Mean of the normalised squared errors after ten seconds, a
// degree of freedom. `told_of_all`: C is told of the own errors as well, as if they lasted.
double mean_nees(bool told_of_all) {
  constexpr int kTrials = 400;
  constexpr int kFrames = 300;
  constexpr double kInterval_s = 1.0 / 30.0;
  constexpr double kLasting_s = 2.0;
  constexpr double kLasting_mm = 0.8;
  constexpr double kGrowth = 5.0;
  constexpr double kShare = 0.1;
  constexpr double kPixel_px = 0.3;
  constexpr double kPrior_mm = 2.0;
  std::mt19937 generator(20261126);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto normal3 = [&] { return Vector3d(normal(generator), normal(generator), normal(generator)); };
  const double kept = std::exp(-kInterval_s / kLasting_s);
  double sum = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    StateMatrix P = kPrior_mm * kPrior_mm * Matrix3d::Identity();
    Vector3d e = kPrior_mm * normal3();
    Vector3d lasting = kLasting_mm * normal3();
    CorrelatedPoseNoise slow(3, kLasting_s);
    for (int frame = 0; frame < kFrames; ++frame) {
      lasting = kept * lasting + std::sqrt(1.0 - kept * kept) * kLasting_mm * normal3();
      const bool bad = uniform(generator) < kShare;
      const double own_mm = bad ? kLasting_mm * std::sqrt(kGrowth * kGrowth - 1.0) : 0.0;
      const Vector3d s = lasting + own_mm * normal3();
      PoseNoiseTerm term;
      term.b = Basis::Ones(1);
      term.dz_dp = 5.0 * so3_exp(2.0 * normal3()).topRows<2>();
      term.dz_ds << Matrix23d::Zero(), -term.dz_dp;
      term.sigma = Matrix6d::Zero();
      term.sigma.bottomRightCorner<3, 3>() =
          (kLasting_mm * kLasting_mm + (told_of_all ? own_mm * own_mm : 0.0)) * Matrix3d::Identity();
      term.R = kPixel_px * kPixel_px * Matrix2d::Identity() +
               (kLasting_mm * kLasting_mm + own_mm * own_mm) * term.dz_dp * term.dz_dp.transpose();
      const Eigen::Matrix<double, 3, 2> PH = P * term.dz_dp.transpose();
      const Eigen::Matrix<double, 3, 2> K = PH * (term.dz_dp * PH + term.R).inverse();
      const Vector2d noise = kPixel_px * Vector2d(normal(generator), normal(generator));
      e += K * (-term.dz_dp * e - term.dz_dp * s + noise);
      P = Matrix3d(P - K * PH.transpose());
      term.M = P;
      if (frame > 0) slow.pass(kInterval_s);
      slow.add(term);
    }
    const Matrix3d covariance = P + slow.covariance();
    sum += e.dot(covariance.ldlt().solve(e)) / 3.0;
  }
  return sum / kTrials;
}

TEST(CorrelatedPoseNoise, IsRightWhereSomePosesHaveErrorsOfTheirOwnBesides) {
  const double nees = mean_nees(false);
  EXPECT_GT(nees, 0.85);  // of 1200 degrees of freedom, 0.92 to 1.08 by chance
  EXPECT_LT(nees, 1.15);
  EXPECT_GT(std::abs(std::log(mean_nees(true))), 2.0 * std::abs(std::log(nees)))
      << "what does not last must not be told as if it did";
}

}  // namespace
}  // namespace perimap
