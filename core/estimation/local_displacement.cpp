#include "core/estimation/local_displacement.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

// Nothing is pressed in by much more: what the features do not tell stays near zero.
constexpr double kDeviation_mm = 10.0;

struct Sum {
  Matrix3d Lambda = Matrix3d::Identity() / (kDeviation_mm * kDeviation_mm);
  Vector3d eta = Vector3d::Zero();

  void add(const OffFeature& feature, double w, double sign) noexcept {
    Lambda += sign * w * w * feature.off.Lambda;
    eta += sign * w * feature.off.eta;
  }
  [[nodiscard]] Vector3d mean() const noexcept { return Lambda.llt().solve(eta); }
};

double weight_at(const OffFeature& feature, const Vector3d& place_W_mm, double radius_mm) noexcept {
  return 1.0 - (feature.p_W_mm - place_W_mm).squaredNorm() / (radius_mm * radius_mm);
}

}  // namespace

void OffMap::add(const Vector2d& r, const Matrix23d& J, const Matrix2d& R, double weight) noexcept {
  const Eigen::Matrix<double, 3, 2> JR = J.transpose() * R.inverse();
  if (!r.allFinite() || !JR.allFinite()) return;
  Lambda += weight * (JR * J);
  eta += weight * (JR * r);
}

OffMap beside_map(const OffMap& off, const Matrix3d& S) noexcept {
  const Matrix3d A = (Matrix3d::Identity() + off.Lambda * S).inverse();
  OffMap beside;
  if (!A.allFinite()) return beside;
  const Matrix3d Lambda = A * off.Lambda;
  beside.Lambda = 0.5 * (Lambda + Lambda.transpose());
  beside.eta = A * off.eta;
  return beside;
}

LocalDisplacement local_displacement(std::span<const OffFeature> features, const Vector3d& place_W_mm,
                                     double radius_mm) noexcept {
  LocalDisplacement found;
  Sum sum;
  for (const OffFeature& feature : features) {
    const double w = weight_at(feature, place_W_mm, radius_mm);
    if (w <= 0.0) continue;
    ++found.features;
    sum.add(feature, w, 1.0);
  }
  if (found.features == 0) return found;
  found.v_W_mm = sum.mean();
  found.size_mm = found.v_W_mm.norm();
  found.chi2 = sum.eta.dot(found.v_W_mm);
  double most = 0.0;
  Sum others = sum;
  for (const OffFeature& feature : features) {
    const double w = weight_at(feature, place_W_mm, radius_mm);
    if (w <= 0.0) continue;
    const double tells = w * feature.off.eta.dot(found.v_W_mm);
    if (tells <= most) continue;
    most = tells;
    others = sum;
    others.add(feature, w, -1.0);
  }
  found.chi2_of_others = others.eta.dot(others.mean());
  return found;
}

}  // namespace perimap
