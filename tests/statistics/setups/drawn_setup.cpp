#include "drawn_setup.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/angle/angle.hpp"

namespace perimap::test {

HandMotion::HandMotion(Draw& draw, double mm, double deg) : mm_(mm), deg_(deg) {
  for (auto& axis : waves_) {
    for (auto& wave : axis) wave = {draw.uniform(0.5, 1.0), draw.uniform(0.1, 0.8), draw.uniform(0.0, 6.3)};
  }
}

Vector6d HandMotion::at(double t_s) const {
  Vector6d value;
  for (int axis = 0; axis < 6; ++axis) {
    double sum = 0.0;
    for (const auto& [a, f, p] : waves_[static_cast<std::size_t>(axis)])
      sum += a * std::sin(2.0 * std::numbers::pi * f * t_s + p) / 3.0;
    value[axis] = sum * (axis < 3 ? deg_ * kDegree : mm_);
  }
  return value;
}

TrackerError::TrackerError(Draw& draw, double correlation_s, double interval_s, double lasting_share)
    : draw_(draw),
      rho_(correlation_s > 0.0 ? std::exp(-interval_s / correlation_s) : 0.0),
      lasting_(std::sqrt(lasting_share)),
      place_(draw.vector(kTracker_mm / std::sqrt(3.0))),
      turn_(draw.vector(kTracker_deg * kDegree / std::sqrt(3.0))) {}

Pose TrackerError::of(const Pose& X) {
  const double fresh = std::sqrt(1.0 - rho_ * rho_);
  place_ = rho_ * place_ + draw_.vector(fresh * kTracker_mm / std::sqrt(3.0));
  turn_ = rho_ * turn_ + draw_.vector(fresh * kTracker_deg * kDegree / std::sqrt(3.0));
  Vector3d place = lasting_ * place_;
  Vector3d turn = lasting_ * turn_;
  if (lasting_ < 1.0) {
    const double at_once = std::sqrt(1.0 - lasting_ * lasting_);
    place += draw_.vector(at_once * kTracker_mm / std::sqrt(3.0));
    turn += draw_.vector(at_once * kTracker_deg * kDegree / std::sqrt(3.0));
  }
  return {X.R * so3_exp(turn), X.t + place};
}

CameraModel drawn_camera(Draw& draw) {
  CameraModel camera;
  camera.width = 1280, camera.height = 720;
  camera.fx = draw.uniform(900.0, 1200.0);
  camera.fy = camera.fx * draw.uniform(0.99, 1.01);
  camera.cx = 640.0 + draw.normal(20.0), camera.cy = 360.0 + draw.normal(20.0);
  camera.k1 = draw.uniform(-0.35, -0.1), camera.k2 = draw.uniform(0.0, 0.12);
  camera.p1 = draw.normal(5e-4), camera.p2 = draw.normal(5e-4);
  return camera;
}

std::vector<Vector3d> chessboard(int columns, int rows, double square_mm) {
  std::vector<Vector3d> points;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) points.push_back(square_mm * Vector3d(x, y, 0.0));
  }
  return points;
}

HandEyeNees nees_of(const Vector7d& error, const Eigen::Matrix<double, 7, 7>& covariance) {
  const auto of = [&](int begin, int count) {
    const Eigen::VectorXd e = error.segment(begin, count);
    const Eigen::MatrixXd C = covariance.block(begin, begin, count, count);
    return e.dot(C.ldlt().solve(e)) / count;
  };
  return {of(0, 3), of(3, 3), of(6, 1), of(0, 7)};
}

double MeanOfMeasured::mean() const { return count_ > 0 ? sum_ / count_ : std::numeric_limits<double>::quiet_NaN(); }

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

}  // namespace perimap::test
