#include "core/estimation/measurement_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "simulated_feature.hpp"

namespace perimap {
namespace {

constexpr double kPi = std::numbers::pi;

const PixelModel kPixel{CameraModel{.width = 640,
                                    .height = 480,
                                    .fx = 520.0,
                                    .fy = 525.0,
                                    .cx = 310.0,
                                    .cy = 250.0,
                                    .k1 = -0.32,
                                    .k2 = 0.12,
                                    .p1 = 0.0006,
                                    .p2 = -0.0009,
                                    .k3 = -0.02}};

Pose some_pose(unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  const Vector3d w(normal(generator), normal(generator), normal(generator));
  const Vector3d t(normal(generator), normal(generator), normal(generator));
  return {so3_exp(w), 60.0 * t};
}

// Central differences of z by `perturb(i, step)`, which returns the pose and point moved along coordinate i.
template <class Model, class Perturb>
Matrix23d numeric_jacobian(const Model& model, double step, Perturb perturb) {
  Matrix23d J;
  for (int i = 0; i < 3; ++i) {
    Vector2d plus;
    Vector2d minus;
    const auto [X_plus, p_plus] = perturb(i, step);
    const auto [X_minus, p_minus] = perturb(i, -step);
    EXPECT_EQ(measure(model, X_plus, p_plus, plus), ProjectionStatus::kOk);
    EXPECT_EQ(measure(model, X_minus, p_minus, minus), ProjectionStatus::kOk);
    J.col(i) = model.residual(plus, minus) / (2.0 * step);
  }
  return J;
}

// At points q in the camera's frame, ugly ones included.
template <class Model>
void expect_jacobians_to_be_derivatives(const Model& model, std::initializer_list<Vector3d> points_in_camera) {
  unsigned seed = 0;
  for (const Vector3d& q : points_in_camera) {
    SCOPED_TRACE(testing::Message() << "q = " << q.transpose());
    const Pose X_CW = some_pose(++seed);
    const Pose X_WC = X_CW.inverse();
    const Vector3d p = X_WC * q;
    Vector2d z;
    MeasurementJacobians J;
    ASSERT_EQ(measure(model, X_CW, p, z, &J), ProjectionStatus::kOk);
    const double length = std::min(std::abs(q.z()) + std::hypot(q.x(), q.y()), std::hypot(q.x(), q.y()) + 1.0);
    const double step = 1e-5 * length;
    const auto moved = [&](int i, double h) { return Vector3d(h * Vector3d::Unit(i)); };
    const auto by_p = [&](int i, double h) { return std::pair(X_CW, Vector3d(p + moved(i, h))); };
    const auto by_c = [&](int i, double h) { return std::pair(Pose{X_CW.R, -(X_CW.R * (X_WC.t + moved(i, h)))}, p); };
    const auto by_theta = [&](int i, double h) {
      const Matrix3d R = so3_exp(moved(i, h)) * X_CW.R;
      return std::pair(Pose{R, -(R * X_WC.t)}, p);
    };
    const auto near = [](const Matrix23d& got, const Matrix23d& expected) {
      return (got - expected).cwiseAbs().maxCoeff() <= 1e-5 * (expected.cwiseAbs().maxCoeff() + 1e-12);
    };
    EXPECT_TRUE(near(J.dz_dp, numeric_jacobian(model, step, by_p)));
    EXPECT_TRUE(near(J.dz_dc, numeric_jacobian(model, step, by_c)));
    EXPECT_TRUE(near(J.dz_dtheta, numeric_jacobian(model, 1e-6, by_theta)));
  }
}

TEST(PixelModel, JacobiansAreDerivativesAtUglyPoints) {
  expect_jacobians_to_be_derivatives(
      kPixel, {Vector3d(0, 0, 90), Vector3d(1e-9, -1e-9, 90), Vector3d(60, 40, 90), Vector3d(-0.5, 0.4, 1.0),
               Vector3d(0, 0, 5000), Vector3d(-900, 700, 1300)});
}

TEST(PixelModel, JacobiansOfAFisheyeAreDerivativesBehindTheCameraToo) {
  expect_jacobians_to_be_derivatives(
      test::kFisheye, {Vector3d(0, 0, 90), Vector3d(1e-9, -1e-9, 90), Vector3d(60, 40, 90), Vector3d(-5, 4, 1.0),
                       Vector3d(80, 10, 0.0), Vector3d(70, -30, -8)});
}

TEST(BearingModel, JacobiansAreDerivativesAtUglyPoints) {
  // Straight ahead, behind at the seam of the azimuth, nearly overhead, tiny and huge ranges.
  expect_jacobians_to_be_derivatives(
      BearingModel{}, {Vector3d(90, 0, 0), Vector3d(-90, 1e-7, 3), Vector3d(-90, -1e-7, -3), Vector3d(1.0, 1.0, 90),
                       Vector3d(0, -90, 40), Vector3d(0.3, 0.2, -0.1), Vector3d(3000, -4000, 2000)});
}

TEST(BearingModel, ResidualIsWrappedToHalfOpenTurn) {
  const BearingModel model;
  EXPECT_NEAR(model.residual({kPi - 0.01, 0.0}, {-kPi + 0.01, 0.0}).x(), -0.02, 1e-14);
  EXPECT_NEAR(model.residual({-kPi + 0.01, 0.2}, {kPi - 0.01, 0.1}).x(), 0.02, 1e-14);
  EXPECT_EQ(model.residual({kPi, 0.0}, {0.0, 0.0}).x(), -kPi);
  EXPECT_EQ(model.residual({-kPi, 0.0}, {0.0, 0.0}).x(), -kPi);
}

TEST(BearingModel, HasNoAzimuthOverhead) {
  Vector2d z;
  EXPECT_EQ(BearingModel{}.predict({0, 0, 50}, z), ProjectionStatus::kNotFinite);
  EXPECT_EQ(BearingModel{}.predict({0, 0, 0}, z), ProjectionStatus::kNotFinite);
  EXPECT_EQ(BearingModel{}.predict({std::numeric_limits<double>::quiet_NaN(), 0, 1}, z), ProjectionStatus::kNotFinite);
}

template <class Model>
void expect_ray_through(const Model& model, const Vector3d& q) {
  Vector2d z;
  Vector3d ray;
  ASSERT_EQ(model.predict(q, z), ProjectionStatus::kOk);
  ASSERT_TRUE(model.ray(z, ray));
  EXPECT_LT((ray - q.normalized()).norm(), 1e-10);
}

TEST(MeasurementModel, RayLeadsThroughWhatWasMeasured) {
  expect_ray_through(kPixel, {20, -30, 80});
  expect_ray_through(BearingModel{}, {-20, -30, 80});
  Vector3d ray;
  EXPECT_FALSE(BearingModel{}.ray({std::numeric_limits<double>::infinity(), 0.0}, ray));
}

TEST(MeasurementModel, PoseNoiseCovarianceIsThatOfPerturbedPoses) {
  std::mt19937 generator(5);
  std::normal_distribution<double> normal;
  const Pose X_CW = some_pose(9);
  const Vector3d c = X_CW.inverse().t;
  const Vector3d p = X_CW.inverse() * Vector3d(15, -10, 80);
  Matrix3d A_c;
  A_c << 0.3, 0, 0, 0.1, 0.2, 0, -0.1, 0.05, 0.4;  // mm
  Matrix3d A_theta;
  A_theta << 2, 0, 0, 1, 1, 0, -1, 0.5, 3;  // mrad
  A_theta *= 1e-3;
  Vector2d z;
  MeasurementJacobians J;
  ASSERT_EQ(measure(kPixel, X_CW, p, z, &J), ProjectionStatus::kOk);
  const Matrix2d expected = pose_noise_covariance(J, A_c * A_c.transpose(), A_theta * A_theta.transpose());
  Matrix2d sampled = Matrix2d::Zero();
  constexpr int kSamples = 20000;
  const auto draw = [&] { return Vector3d(normal(generator), normal(generator), normal(generator)); };
  for (int i = 0; i < kSamples; ++i) {
    const Matrix3d R = so3_exp(A_theta * draw()) * X_CW.R;
    Vector2d noisy;
    ASSERT_EQ(measure(kPixel, {R, -(R * (c + A_c * draw()))}, p, noisy), ProjectionStatus::kOk);
    sampled += (noisy - z) * (noisy - z).transpose() / kSamples;
  }
  EXPECT_LT((sampled - expected).norm(), 0.04 * expected.norm());
}

}  // namespace
}  // namespace perimap
