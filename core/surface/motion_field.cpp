#include "core/surface/motion_field.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/surface/common_noise.hpp"
#include "core/surface/six_elements.hpp"

namespace perimap {
namespace {

// Variance of the free mean in units of the signal's.
constexpr double kFreeMean = 100.0;

// A motion that takes away less than a fifth of what neighbours leave unexplained is not the organ's.
constexpr double kWorthIt = 0.8;

enum Component { kXx, kXy, kXz, kYy, kYz, kZz };

Eigen::MatrixXd with_free_mean(const Eigen::ArrayXXd& r_mm, double length_mm) {
  return (matern52(r_mm, length_mm) + kFreeMean).matrix();
}

// L^-1 of outputs less their mean, with L that of K + diag(nu). Nothing when there is no L.
std::optional<Eigen::MatrixXd> whitened(const Kernel& kernel, const Eigen::ArrayXXd& r_mm,
                                        const Eigen::VectorXd& noise_mm2, const Eigen::MatrixXd& outputs_mm) {
  Eigen::MatrixXd K = with_free_mean(r_mm, kernel.length_mm);
  K.diagonal() += relative_noise(noise_mm2, kernel.noise);
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(K);
  if (cholesky.info() != Eigen::Success) return std::nullopt;
  return cholesky.matrixL().solve(outputs_mm.rowwise() - outputs_mm.colwise().mean());
}

}  // namespace

bool MotionField::fit(Direction& direction, const Eigen::MatrixXd& outputs_mm, Eigen::Index outputs_a_band,
                      const Eigen::ArrayXXd& r_mm, KernelSearch search) {
  direction.offset_mm = outputs_mm.colwise().mean();
  const Eigen::MatrixXd Y = outputs_mm.rowwise() - direction.offset_mm;
  const Eigen::MatrixXd K_free = Eigen::MatrixXd::Constant(r_mm.rows(), r_mm.cols(), kFreeMean);
  std::vector<OutputBand> bands;
  for (Eigen::Index first = 0; first < Y.cols(); first += outputs_a_band) bands.push_back({first, outputs_a_band});
  const KernelProblem problem{r_mm, K_free, 1, direction.noise_mm2, Y, bands};
  if (search != KernelSearch::kNone) direction.kernel = learn_kernel(problem, direction.kernel, search);
  direction.process = process_with(problem, direction.kernel);
  if (!direction.process) return false;
  direction.scale = noise_scale(problem, direction.kernel, *direction.process);
  return true;
}

bool MotionField::fit_gains(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm) {
  const auto both = [&](const Direction& direction, const Eigen::MatrixXd& seen_mm, const Eigen::MatrixXd& model_mm) {
    Eigen::MatrixXd all_mm(seen_mm.rows(), 2 * seen_mm.cols());
    all_mm << seen_mm, model_mm;
    std::optional<WhitenedHarmonics> out;
    if (const auto white = whitened(direction.kernel, r_mm, direction.noise_mm2, all_mm)) {
      out = {white->leftCols(seen_mm.cols()), white->rightCols(seen_mm.cols())};
    }
    return out;
  };
  const auto across = both(across_, motion.seen.across_mm, motion.model.across_mm);
  const auto along = both(along_, motion.seen.along_mm, motion.model.along_mm);
  if (!across || !along) return false;
  gains_ = likeliest_gains(*across, *along, r_mm.rows() - 1);
  return true;
}

bool MotionField::fit_rest(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm, KernelSearch search) {
  ChartedHarmonics rest = motion.seen;
  if (!gains_.empty()) {
    const ChartedHarmonics explained = scaled(motion.model, gains_);
    rest.across_mm -= explained.across_mm;
    rest.along_mm -= explained.along_mm;
  }
  const auto of_bands = [&rest](const Eigen::MatrixXd& mm, const Direction& direction) {
    const Eigen::Index outputs = mm.cols() / rest.bands();
    const Eigen::RowVectorXd squares = mm.colwise().squaredNorm() / static_cast<double>(mm.rows());
    const Eigen::VectorXd of_each = squares.reshaped(outputs, rest.bands()).colwise().mean();
    return Eigen::VectorXd((of_each.array() - direction.noise_mm2.mean()).max(0.0));
  };
  across_.rest_mm2 = of_bands(rest.across_mm, across_);
  along_.rest_mm2 = of_bands(rest.along_mm, along_);
  return fit(across_, rest.across_mm, 4, r_mm, search) && fit(along_, rest.along_mm, 2, r_mm, search);
}

void MotionField::claim(const ChartedMotion& motion) {
  noise_A_mm2_ = motion.noise_A_mm2;
  // Of one coefficient: a band's share of the position's variance is that of its cosine.
  const auto bands = static_cast<double>(motion.seen.bands());
  across_.noise_mm2 = (noise_A_mm2_.row(kXx) + noise_A_mm2_.row(kYy)).transpose() * (0.5 / bands);
  along_.noise_mm2 = noise_A_mm2_.row(kZz).transpose() / bands;
}

std::optional<MotionField> MotionField::fit_alone(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm,
                                                  const Kernels& kernels, KernelSearch search) {
  MotionField field;
  field.claim(motion);
  field.across_.kernel = kernels.across;
  field.along_.kernel = kernels.along;
  if (!field.fit_rest(motion, r_mm, search)) return std::nullopt;
  return field;
}

std::optional<MotionField> MotionField::fit_beside(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm,
                                                   const Kernels& kernels, KernelSearch search) {
  MotionField field;
  field.claim(motion);
  field.across_.kernel = kernels.rest_across;
  field.along_.kernel = kernels.rest_along;
  for (const auto& [direction, model_mm] :
       {std::pair(&field.across_, &motion.model.across_mm), std::pair(&field.along_, &motion.model.along_mm)}) {
    direction->model_offset_mm = model_mm->colwise().mean();
    direction->model_mm = model_mm->rowwise() - direction->model_offset_mm;
  }
  // The gains go by the kernels, and these by what the gains leave: the likeliest of both, in turns.
  if (!field.fit_gains(motion, r_mm) || !field.fit_rest(motion, r_mm, search)) return std::nullopt;
  if (search == KernelSearch::kNone) return field;
  if (!field.fit_gains(motion, r_mm) || !field.fit_rest(motion, r_mm, KernelSearch::kNone)) return std::nullopt;
  return field;
}

bool MotionField::betters(const MotionField& other) const {
  const auto cost = [](const MotionField& of) {
    return of.across_.process->cost() + of.along_.process->cost() + cost_of(of.gains_);
  };
  // Of each feature, without what its own errors are claimed to make of it.
  const auto left_out_mm2 = [](const MotionField& of) {
    const LeaveOneOut left = of.leave_one_out();
    const Eigen::Index bands = of.along_.rest_mm2.size();
    const double own_mm2 = static_cast<double>(bands) * (2.0 * of.across_.noise_mm2.sum() + of.along_.noise_mm2.sum());
    return std::max(0.0, 2.0 * left.across_mm2.sum() + left.along_mm2.sum() - own_mm2);
  };
  return cost(*this) < cost(other) && left_out_mm2(*this) <= kWorthIt * left_out_mm2(other);
}

std::optional<MotionField> MotionField::fit(const ChartedMotion& motion, const Eigen::ArrayXXd& r_mm,
                                            const Kernels& kernels, KernelSearch search) {
  Kernels learnt = kernels;
  std::optional<MotionField> field = fit_alone(motion, r_mm, kernels, search);
  if (field) {
    learnt.across = field->across_.kernel;
    learnt.along = field->along_.kernel;
  }
  if (!motion.model.along_mm.isZero(0.0)) {
    std::optional<MotionField> beside = fit_beside(motion, r_mm, kernels, search);
    if (beside) {
      learnt.rest_across = beside->across_.kernel;
      learnt.rest_along = beside->along_.kernel;
    }
    if (beside && (!field || beside->betters(*field))) field = std::move(beside);
  }
  if (field) field->kernels_ = learnt;
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

ChartedHarmonics MotionField::by_gains(const Weights& weights, const ChartedHarmonics& model) const {
  const auto less = [](const Eigen::MatrixXd& there_mm, const Direction& direction, const Eigen::MatrixXd& W) {
    return Eigen::MatrixXd((there_mm.rowwise() - direction.model_offset_mm) - W.transpose() * direction.model_mm);
  };
  return {less(model.across_mm, across_, weights.across), less(model.along_mm, along_, weights.along)};
}

MotionField::Prediction MotionField::at(const Eigen::ArrayXXd& r_mm, const ChartedHarmonics& model) const {
  const Weights weights = this->weights(r_mm);
  const Eigen::MatrixXd& W_across = weights.across;
  const Eigen::MatrixXd& W_along = weights.along;

  Prediction prediction;
  ChartedHarmonics& out = prediction.motion;
  out.across_mm = (W_across.transpose() * across_.process->Y()).rowwise() + across_.offset_mm;
  out.along_mm = (W_along.transpose() * along_.process->Y()).rowwise() + along_.offset_mm;

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
  if (gains_.empty()) return prediction;

  const ChartedHarmonics explained = scaled(model, gains_);
  out.across_mm += explained.across_mm;
  out.along_mm += explained.along_mm;
  const ChartedHarmonics by = by_gains(weights, model);
  for (Eigen::Index v = 0; v < r_mm.cols(); ++v) covariance.col(v) += to_six(gain_covariance_mm2(by, gains_, v));
  return prediction;
}

Matrix3d MotionField::unseen_A_mm2(const ChartedHarmonics& model, Eigen::Index v) const {
  Vector3d variances = Vector3d::Zero();
  const bool moves = !gains_.empty();
  for (Eigen::Index band = 0; band < across_.rest_mm2.size(); ++band) {
    double larger = 1.0;
    if (moves) {
      const auto there = [&](const Eigen::MatrixXd& mm, Eigen::Index outputs) {
        return mm.row(v).segment(outputs * band, outputs).squaredNorm();
      };
      const auto at_features = [&](const Direction& direction, Eigen::Index outputs) {
        const auto columns = direction.model_mm.middleCols(outputs * band, outputs);
        return columns.squaredNorm() / static_cast<double>(columns.rows()) +
               direction.model_offset_mm.segment(outputs * band, outputs).squaredNorm();
      };
      const double usual_mm2 = at_features(across_, 4) + at_features(along_, 2);
      const double there_mm2 = there(model.across_mm, 4) + there(model.along_mm, 2);
      if (usual_mm2 > 0.0) larger = std::max(1.0, there_mm2 / usual_mm2);
    }
    const double across = larger * std::max(variances_across()(band), across_.rest_mm2(band));
    const double along = larger * std::max(variances_along()(band), along_.rest_mm2(band));
    variances += Vector3d(across, across, along);
  }
  Matrix3d covariance = variances.asDiagonal();
  if (moves) covariance += gain_covariance_mm2(model, gains_, v);
  return covariance;
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
