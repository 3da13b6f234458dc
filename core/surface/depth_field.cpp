#include "core/surface/depth_field.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/surface/common_noise.hpp"

namespace perimap {
namespace {

// Variance of what is free, in units of the signal's: as good as unbounded, and far from what rounding would spoil.
constexpr double kFreePlane = 100.0;

// Slope of the depth at place i, by its neighbours.
Vector2d slope_at(const ChartedPlaces& places, Eigen::Index i) {
  constexpr std::size_t kNeighbours = 8;
  const auto N = static_cast<std::size_t>(places.depth_mm.size());
  std::vector<std::pair<double, Eigen::Index>> nearest;
  nearest.reserve(N);
  for (Eigen::Index j = 0; j < places.depth_mm.size(); ++j) {
    if (j != i) nearest.emplace_back((places.s_mm.col(j) - places.s_mm.col(i)).squaredNorm(), j);
  }
  const auto end = nearest.begin() + static_cast<std::ptrdiff_t>(std::min(kNeighbours, nearest.size()));
  std::partial_sort(nearest.begin(), end, nearest.end());
  Matrix2d normal = Matrix2d::Zero();
  Vector2d right = Vector2d::Zero();
  for (auto it = nearest.begin(); it != end; ++it) {
    const Vector2d d = places.s_mm.col(it->second) - places.s_mm.col(i);
    normal += d * d.transpose();
    right += (places.depth_mm(it->second) - places.depth_mm(i)) * d;
  }
  // Neighbours on a line tell nothing across it.
  normal += 1e-2 * (normal.trace() + 1e-9) * Matrix2d::Identity();
  return normal.inverse() * right;
}

// Of the depth at a bearing, from the covariance of a place: an error d of the place raises the surface there by
// G . d, where G is normal to it and has 1 along the ray.
double depth_variance(const SurfaceChart& chart, const ChartedPlaces& places, Eigen::Index i) {
  const Vector2d slope = slope_at(places, i);
  const Vector2d s = places.s_mm.col(i);
  const double z = places.depth_mm(i);
  const Vector2d across = -(chart.depth_mm / z) * slope;
  const Vector3d G(across.x(), across.y(), 1.0 + slope.dot(s) / z);
  return std::max(0.0, G.dot(places.covariances_A_mm2[static_cast<std::size_t>(i)] * G));
}

}  // namespace

std::optional<DepthField> DepthField::fit(const SurfaceChart& chart, const ChartedPlaces& places, const Kernel& kernel,
                                          KernelSearch search) {
  DepthField field;
  field.s_mm_ = places.s_mm;
  field.mean_mm_ = places.depth_mm.mean();
  field.plane_mm_ = std::sqrt(places.s_mm.colwise().squaredNorm().mean());
  field.noise_mm2_.resize(places.depth_mm.size());
  for (Eigen::Index i = 0; i < places.depth_mm.size(); ++i) field.noise_mm2_(i) = depth_variance(chart, places, i);
  const Eigen::ArrayXXd r_mm = distances(places.s_mm, places.s_mm);
  const Eigen::MatrixXd K_free = field.free_plane(places.s_mm, places.s_mm);
  const Eigen::MatrixXd Y = (places.depth_mm.array() - field.mean_mm_).matrix();
  const std::vector<OutputBand> bands = {{0, 1}};
  const KernelProblem problem{r_mm, K_free, 3, field.noise_mm2_, Y, bands};
  field.kernel_ = search == KernelSearch::kNone ? kernel : learn_kernel(problem, kernel, search);
  field.process_ = process_with(problem, field.kernel_);
  if (!field.process_) return std::nullopt;
  field.scale_ = perimap::noise_scale(problem, field.kernel_, *field.process_);
  return field;
}

Eigen::MatrixXd DepthField::free_plane(const Eigen::Matrix2Xd& a, const Eigen::Matrix2Xd& b) const {
  return (kFreePlane * (1.0 + (a.transpose() * b).array() / (plane_mm_ * plane_mm_))).matrix();
}

DepthField::Prediction DepthField::at(const Eigen::Matrix2Xd& s_mm) const {
  const Eigen::MatrixXd K_star = matern52(distances(s_mm_, s_mm), kernel_.length_mm).matrix() + free_plane(s_mm_, s_mm);
  const Eigen::MatrixXd W = process_->weights(K_star);
  const Eigen::ArrayXd own =
      1.0 + kFreePlane * (1.0 + s_mm.colwise().squaredNorm().transpose().array() / (plane_mm_ * plane_mm_));
  Prediction prediction;
  prediction.depth_mm = mean_mm_ + (W.transpose() * process_->Y()).col(0).array();
  const double signal_mm2 = process_->signal_variances()(0);
  prediction.variance_mm2 = signal_mm2 * process_->unexplained(K_star, W, own) +
                            signal_mm2 * (W.array().square().matrix().transpose() * process_->nu()).array() +
                            noise_in_common(W, noise_mm2_, scale_).col(0);
  return prediction;
}

Vector2d DepthField::slope_at(const Vector2d& s_mm) const {
  constexpr double kStep_mm = 0.05;
  Eigen::Matrix2Xd around(2, 4);
  around.colwise() = s_mm;
  around(0, 0) += kStep_mm;
  around(0, 1) -= kStep_mm;
  around(1, 2) += kStep_mm;
  around(1, 3) -= kStep_mm;
  const Eigen::MatrixXd K_star =
      matern52(distances(s_mm_, around), kernel_.length_mm).matrix() + free_plane(s_mm_, around);
  const Eigen::Vector4d depth = (K_star.transpose() * process_->alpha()).col(0);
  return Vector2d(depth(0) - depth(1), depth(2) - depth(3)) / (2.0 * kStep_mm);
}

DepthField::LeaveOneOut DepthField::leave_one_out() const {
  const GaussianProcess::LeaveOneOut out = process_->leave_one_out();
  return {out.residuals.col(0).array(), process_->signal_variances()(0) * out.variances.array()};
}

}  // namespace perimap
