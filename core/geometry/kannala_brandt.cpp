#include "core/geometry/kannala_brandt.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace perimap {
namespace {

// A ray straight backwards has no direction in the image; lenses end long before.
constexpr double kMaxAngle = 0.98 * std::numbers::pi;

// theta_d and its derivative.
struct ImageAngle {
  double value;
  double slope;
};

ImageAngle image_angle(const KannalaBrandt& lens, double theta) noexcept {
  const double u = theta * theta;
  return {theta * (1.0 + u * (lens.k1 + u * (lens.k2 + u * (lens.k3 + u * lens.k4)))),
          1.0 + u * (3.0 * lens.k1 + u * (5.0 * lens.k2 + u * (7.0 * lens.k3 + u * 9.0 * lens.k4)))};
}

// Whether theta_d grows all the way out to theta: each power of the slope is bounded from below on each of a row of
// intervals. Where the slope all but vanishes this may say no too early, where no measurement is worth anything.
bool grows_up_to(const KannalaBrandt& lens, double theta) noexcept {
  const std::array<double, 4> g = {3.0 * lens.k1, 5.0 * lens.k2, 7.0 * lens.k3, 9.0 * lens.k4};
  const double end = theta * theta;
  const auto positive_on = [&g](double a, double b) {
    double bound = 1.0;
    double power_a = 1.0;
    double power_b = 1.0;
    for (const double coefficient : g) {
      power_a *= a;
      power_b *= b;
      bound += std::min(coefficient * power_a, coefficient * power_b);
    }
    return bound > 0.0;
  };
  if (positive_on(0.0, end)) return true;
  constexpr int kIntervals = 256;
  for (int i = 0; i < kIntervals; ++i) {
    if (!positive_on(end * i / kIntervals, end * (i + 1) / kIntervals)) return false;
  }
  return true;
}

}  // namespace

bool KannalaBrandt::distort(const Vector3d& q, Vector2d& m, Eigen::Matrix<double, 2, 3>& dm_dq) const noexcept {
  const double x = q.x();
  const double y = q.y();
  const double z = q.z();
  const double r = std::hypot(x, y);
  const double theta = std::atan2(r, z);
  if (theta > kMaxAngle || !grows_up_to(*this, theta)) return false;
  const ImageAngle angle = image_angle(*this, theta);
  // m = s (x, y) with s = theta_d / r; ds/dx = a x, ds/dy = a y.
  double s = angle.value / r;
  const double radial = angle.slope / (r * r + z * z);
  double a = (radial * z - s) / (r * r);
  // Near the axis both are 0/0; with t = r/z the series of s is (1 + (k1 - 1/3) t^2 + ..) / z.
  if (theta < 1e-4) {
    const double t = r / z;
    s = (1.0 + (k1 - 1.0 / 3.0) * t * t) / z;
    a = 2.0 * (k1 - 1.0 / 3.0) / (z * z * z);
  }
  m << s * x, s * y;
  dm_dq << s + a * x * x, a * x * y, -radial * x, a * x * y, s + a * y * y, -radial * y;
  return true;
}

bool KannalaBrandt::undistort(const Vector2d& m, Vector3d& ray_C) const noexcept {
  const double target = m.norm();
  // Newton's method from the axis, shortened so that it keeps to where theta_d grows and always comes nearer.
  constexpr int kMaxIterations = 50;
  constexpr int kMaxHalvings = 20;
  const double tolerance = 1e-15 * (1.0 + target);
  double theta = 0.0;
  ImageAngle angle = image_angle(*this, theta);
  for (int i = 0; i < kMaxIterations && std::abs(target - angle.value) > tolerance; ++i) {
    const double step = (target - angle.value) / angle.slope;
    bool nearer = false;
    for (int halvings = 0; halvings < kMaxHalvings && !nearer; ++halvings) {
      const double trial = theta + std::ldexp(step, -halvings);
      if (trial < 0.0 || trial > kMaxAngle || !grows_up_to(*this, trial)) continue;
      const ImageAngle trial_angle = image_angle(*this, trial);
      nearer = std::abs(target - trial_angle.value) < std::abs(target - angle.value);
      if (nearer) {
        theta = trial;
        angle = trial_angle;
      }
    }
    if (!nearer) break;
  }
  if (!(std::abs(target - angle.value) < 1e-12 * (1.0 + target))) return false;
  const double across = target > 0.0 ? std::sin(theta) / target : 0.0;
  ray_C << across * m.x(), across * m.y(), std::cos(theta);
  return true;
}

}  // namespace perimap
