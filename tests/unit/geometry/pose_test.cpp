#include "core/geometry/pose.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace perimap {
namespace {

Vector3d random_vector(std::mt19937& generator, double scale) {
  std::normal_distribution<double> normal(0.0, scale);
  return {normal(generator), normal(generator), normal(generator)};
}

TEST(Pose, LogUndoesExpFromTinyAnglesToPi) {
  std::mt19937 generator(7);
  for (const double angle : {0.0, 1e-12, 1e-9, 1e-5, 1e-4, 0.1, 1.0, 3.0, std::numbers::pi - 1e-6}) {
    const Vector3d w = angle * random_vector(generator, 1.0).normalized();
    EXPECT_LT((so3_log(so3_exp(w)) - w).norm(), 1e-9) << "angle " << angle;
  }
}

TEST(Pose, LogAtPiHasLengthPi) {
  const Matrix3d R = Vector3d(1.0, -1.0, -1.0).asDiagonal();
  EXPECT_NEAR(so3_log(R).norm(), std::numbers::pi, 1e-12);
}

TEST(Pose, ExpIsARotation) {
  std::mt19937 generator(8);
  for (int i = 0; i < 100; ++i) {
    const Matrix3d R = so3_exp(random_vector(generator, 2.0));
    EXPECT_LT((R * R.transpose() - Matrix3d::Identity()).norm(), 1e-13);
    EXPECT_NEAR(R.determinant(), 1.0, 1e-13);
  }
}

TEST(Pose, CompositionWithTheInverseIsIdentity) {
  std::mt19937 generator(9);
  const Pose X{so3_exp(random_vector(generator, 1.0)), random_vector(generator, 100.0)};
  const Pose I = X * X.inverse();
  EXPECT_LT((I.R - Matrix3d::Identity()).norm(), 1e-13);
  EXPECT_LT(I.t.norm(), 1e-12);
}

TEST(Pose, InterpolationMeetsBothEndsAndTurnsEvenly) {
  std::mt19937 generator(10);
  const Pose X_0{so3_exp(random_vector(generator, 1.0)), random_vector(generator, 50.0)};
  const Vector3d w = random_vector(generator, 0.3);
  const Pose X_1{X_0.R * so3_exp(w), X_0.t + Vector3d(3.0, -6.0, 9.0)};
  EXPECT_LT((interpolate(X_0, X_1, 0.0).R - X_0.R).norm(), 1e-13);
  EXPECT_LT((interpolate(X_0, X_1, 1.0).R - X_1.R).norm(), 1e-12);
  const Pose X_third = interpolate(X_0, X_1, 1.0 / 3.0);
  EXPECT_LT((X_third.t - (X_0.t + Vector3d(1.0, -2.0, 3.0))).norm(), 1e-12);
  EXPECT_LT((so3_log(X_0.R.transpose() * X_third.R) - w / 3.0).norm(), 1e-12);
}

TEST(Pose, QuaternionRoundTripKeepsTheRotation) {
  std::mt19937 generator(11);
  for (int i = 0; i < 50; ++i) {
    const Matrix3d R = so3_exp(random_vector(generator, 2.0));
    double wxyz[4];
    rotation_to_wxyz(R, wxyz);
    EXPECT_GE(wxyz[0], 0.0);
    EXPECT_LT((pose_from_wxyz(Vector3d::Zero(), wxyz).R - R).norm(), 1e-13);
  }
}

}  // namespace
}  // namespace perimap
