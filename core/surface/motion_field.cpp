#include "core/surface/motion_field.hpp"

#include <algorithm>
#include <cmath>

#include "core/surface/common_noise.hpp"

namespace perimap {
namespace {

// Variance of the free mean in units of the signal's.
constexpr double kFreeMean = 100.0;

enum Component { kXx, kXy, kXz, kYy, kYz, kZz };

Eigen::MatrixXd with_free_mean(const Eigen::ArrayXXd& r_mm, double length_mm) {
  return (matern52(r_mm, length_mm) + kFreeMean).matrix();
}

}  // namespace

bool MotionField::fit(Direction& direction, const Eigen::MatrixXd& outputs_mm, Eigen::Index outputs_a_band,
                      const Eigen::VectorXd& noise_mm2, const Eigen::ArrayXXd& r_mm, KernelSearch search) {
  direction.offset_mm = outputs_mm.colwise().mean();
  const Eigen::MatrixXd Y = outputs_mm.rowwise() - direction.offset_mm;
  const Eigen::MatrixXd K_free = Eigen::MatrixXd::Constant(r_mm.rows(), r_mm.cols(), kFreeMean);
  std::vector<OutputBand> bands;
  for (Eigen::Index first = 0; first < Y.cols(); first += outputs_a_band) bands.push_back({first, outputs_a_band});
  const KernelProblem problem{r_mm, K_free, 1, noise_mm2, Y, bands};
  if (search != KernelSearch::kNone) direction.kernel = learn_kernel(problem, direction.kernel, search);
  direction.process = process_with(problem, direction.kernel);
  if (!direction.process) return false;
  direction.scale = noise_scale(problem, direction.kernel, *direction.process);
  return true;
}

std::optional<MotionField> MotionField::fit(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm,
                                            const Kernels& kernels, KernelSearch search) {
  MotionField field;
  field.noise_A_mm2_ = motion.noise_A_mm2;
  field.across_.kernel = kernels.across;
  field.along_.kernel = kernels.along;
  // Of one coefficient: a band's share of the position's variance is that of its cosine.
  const Eigen::Index bands = motion.along_mm.cols() / 2;
  const Eigen::VectorXd across =
      (motion.noise_A_mm2.row(kXx) + motion.noise_A_mm2.row(kYy)).transpose() * (0.5 / static_cast<double>(bands));
  const Eigen::VectorXd along = motion.noise_A_mm2.row(kZz).transpose() / static_cast<double>(bands);
  if (!fit(field.across_, motion.across_mm, 4, across, r_mm, search)) return std::nullopt;
  if (!fit(field.along_, motion.along_mm, 2, along, r_mm, search)) return std::nullopt;
  field.kernels_ = {field.across_.kernel, field.along_.kernel};
  return field;
}

MotionField::Weights MotionField::weights(const Eigen::ArrayXXd& r_mm) const {
  const Eigen::ArrayXd own = Eigen::ArrayXd::Constant(r_mm.cols(), 1.0 + kFreeMean);
  const Eigen::MatrixXd K_across = with_free_mean(r_mm, across_.kernel.length_mm);
  const Eigen::MatrixXd K_along = with_free_mean(r_mm, along_.kernel.length_mm);
  Weights weights;
  weights.across = across_.process->weights(K_across);
  weights.along = along_.process->weights(K_along);
  weights.unexplained_across = across_.process->unexplained(K_across, weights.across, own);
  weights.unexplained_along = along_.process->unexplained(K_along, weights.along, own);
  return weights;
}

MotionField::Prediction MotionField::at(const Eigen::ArrayXXd& r_mm) const {
  const Weights weights = this->weights(r_mm);
  const Eigen::MatrixXd& W_across = weights.across;
  const Eigen::MatrixXd& W_along = weights.along;

  Prediction prediction;
  prediction.across_mm = (W_across.transpose() * across_.process->Y()).rowwise() + across_.offset_mm;
  prediction.along_mm = (W_along.transpose() * along_.process->Y()).rowwise() + along_.offset_mm;

  // The observations' own errors: sum of D N D with D the weights of the three axes, which is no covariance's loss.
  Matrix6Xd& covariance = prediction.covariance_A_mm2;
  covariance.resize(6, r_mm.cols());
  const auto of = [&](const Eigen::MatrixXd& products, Component component) {
    return noise_A_mm2_.row(component) * products;
  };
  const Eigen::MatrixXd across2 = across_.scale * W_across.array().square().matrix();
  const Eigen::MatrixXd along2 = along_.scale * W_along.array().square().matrix();
  const Eigen::MatrixXd both = std::sqrt(across_.scale * along_.scale) * W_across.cwiseProduct(W_along);
  for (const Component component : {kXx, kXy, kYy}) covariance.row(component) = of(across2, component);
  for (const Component component : {kXz, kYz}) covariance.row(component) = of(both, component);
  covariance.row(kZz) = of(along2, kZz);

  // What they have in common, likewise with the weights of those across.
  const Eigen::MatrixXd noise = noise_A_mm2_.transpose();
  const Eigen::ArrayXXd common = noise_in_common(W_across, noise, 0.0);
  const double share_across = std::max(0.0, 1.0 - across_.scale);
  const double share_along = std::max(0.0, 1.0 - along_.scale);
  for (const Component component : {kXx, kXy, kYy}) {
    covariance.row(component).array() += share_across * common.col(component).transpose();
  }
  for (const Component component : {kXz, kYz}) {
    covariance.row(component).array() += std::sqrt(share_across * share_along) * common.col(component).transpose();
  }
  covariance.row(kZz).array() += share_along * common.col(kZz).transpose();

  // What interpolating leaves.
  const Eigen::ArrayXd left_across = variances_across().sum() * weights.unexplained_across;
  const Eigen::ArrayXd left_along = variances_along().sum() * weights.unexplained_along;
  covariance.row(kXx).array() += left_across.transpose();
  covariance.row(kYy).array() += left_across.transpose();
  covariance.row(kZz).array() += left_along.transpose();
  return prediction;
}

MotionField::LeaveOneOut MotionField::leave_one_out() const {
  LeaveOneOut out;
  const auto judge = [](const Direction& direction, double axes, Eigen::ArrayXd& squares, Eigen::ArrayXd& variances) {
    const GaussianProcess::LeaveOneOut left = direction.process->leave_one_out();
    squares = left.residuals.rowwise().squaredNorm().array() * (0.5 / axes);
    variances = direction.process->signal_variances().sum() * left.variances.array();
  };
  judge(across_, 2.0, out.across_mm2, out.across_variance_mm2);
  judge(along_, 1.0, out.along_mm2, out.along_variance_mm2);
  return out;
}

}  // namespace perimap
