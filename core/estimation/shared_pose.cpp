#include "core/estimation/shared_pose.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/estimation/student_t_loss.hpp"

namespace perimap {
namespace {

// Inverse of a symmetric positive definite 2x2; false when it is not one, or not finite.
bool invert(const Matrix2d& C, Matrix2d& inverse) noexcept {
  const double determinant = C(0, 0) * C(1, 1) - C(0, 1) * C(1, 0);
  if (!(C(0, 0) > 0.0) || !(determinant > 0.0) || !std::isfinite(determinant)) return false;
  const double off = -0.5 * (C(0, 1) + C(1, 0)) / determinant;
  inverse << C(1, 1) / determinant, off, off, C(0, 0) / determinant;
  return true;
}

Pose corrected(const Pose& X_CW, const CommonVector& s) noexcept {
  const Vector3d c = -(X_CW.R.transpose() * X_CW.t) + s.segment<3>(3);
  const Matrix3d R = so3_exp(s.head<3>()) * X_CW.R;
  return {R, -(R * c)};
}

enum class Weighting : std::uint8_t { kStudent, kGate };

}  // namespace

CommonInformation tracker_prior(const Matrix3d& sigma_theta, const Matrix3d& sigma_c) noexcept {
  CommonInformation prior = CommonInformation::zero(kPoseUnknowns);
  prior.Lambda.topLeftCorner<3, 3>() = sigma_theta.inverse();
  prior.Lambda.bottomRightCorner<3, 3>() = sigma_c.inverse();
  return prior;
}

CommonInformation with_appended(const CommonInformation& prior, double variance) noexcept {
  const Eigen::Index n = prior.eta.size();
  CommonInformation longer = CommonInformation::zero(n + 1);
  longer.Lambda.topLeftCorner(n, n) = prior.Lambda;
  longer.eta.head(n) = prior.eta;
  longer.Lambda(n, n) = 1.0 / variance;
  return longer;
}

CommonEstimate solve_common(const Pose& X_CW, const CommonInformation& information) noexcept {
  CommonEstimate estimate;
  const Eigen::Index n = information.eta.size();
  const Eigen::LLT<CommonMatrix> factor(information.Lambda);
  if (n < kPoseUnknowns || factor.info() != Eigen::Success) return estimate;
  estimate.s = factor.solve(information.eta);
  estimate.covariance = factor.solve(CommonMatrix::Identity(n, n));
  estimate.X_CW = corrected(X_CW, estimate.s);
  estimate.ok = estimate.s.allFinite() && estimate.covariance.allFinite();
  return estimate;
}

template <class Model>
CommonTerm linearise(const Model& model, const CommonEstimate& at, const CommonMatch& match) noexcept {
  const Eigen::Index n = at.s.size();
  const Eigen::Index appended = n - kPoseUnknowns;
  CommonTerm term;
  term.information = CommonInformation::zero(n);
  term.J_s = CommonJacobian::Zero(2, n);
  Vector3d p = match.p_WF;
  if (appended > 0) p += match.D * at.s.tail(appended);
  Vector2d z;
  MeasurementJacobians J;
  if (match.D.cols() != appended || measure(model, at.X_CW, p, z, &J) != ProjectionStatus::kOk) return term;
  term.J_s.template leftCols<3>() = J.dz_dtheta;
  term.J_s.template middleCols<3>(3) = J.dz_dc;
  if (appended > 0) term.J_s.rightCols(appended) = J.dz_dp * match.D;
  const Vector2d r = model.residual(match.z, z);
  const Matrix2d C = match.R + J.dz_dp * match.S * J.dz_dp.transpose();
  Matrix2d C_inverse;
  Matrix2d residual_inverse;
  if (!r.allFinite() || !invert(C, C_inverse) || !invert(C + common_noise(term.J_s, at.covariance), residual_inverse))
    return term;
  const CommonJacobian WJ = C_inverse * term.J_s;
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j; i < n; ++i)
      term.information.Lambda(i, j) = term.information.Lambda(j, i) = term.J_s.col(i).dot(WJ.col(j));
  }
  term.information.eta = WJ.transpose() * (r + term.J_s * at.s);
  term.r = r;
  term.squared_residual = r.dot(residual_inverse * r);
  term.visible = true;
  return term;
}

template <class Model>
SharedPose estimate_shared_pose(const Model& model, const Pose& X_CW, const CommonInformation& prior,
                                std::span<const CommonMatch> matches, std::span<std::uint8_t> used,
                                const SharedPoseSettings& settings) noexcept {
  SharedPose shared;
  shared.estimate = solve_common(X_CW, prior);
  for (int i = 0; i < settings.robust_iterations + settings.final_iterations && shared.estimate.ok; ++i) {
    const Weighting weighting = i < settings.robust_iterations ? Weighting::kStudent : Weighting::kGate;
    shared.linearised_at = shared.estimate;
    shared.information = prior;
    shared.used = 0;
    for (std::size_t begin = 0; begin < matches.size(); begin += kCommonGroup) {
      CommonInformation group = CommonInformation::zero(prior.eta.size());
      for (std::size_t k = begin; k < std::min(begin + kCommonGroup, matches.size()); ++k) {
        CommonTerm term = linearise(model, shared.linearised_at, matches[k]);
        double weight = term.visible ? 1.0 : 0.0;
        if (term.visible && weighting == Weighting::kStudent) weight = student_t_weight(term.squared_residual);
        if (term.visible && weighting == Weighting::kGate) weight = term.squared_residual < settings.gate ? 1.0 : 0.0;
        if (k < used.size()) used[k] = weight > 0.0 ? 1 : 0;
        if (weight == 0.0) continue;
        ++shared.used;
        term.information.Lambda *= weight;
        term.information.eta *= weight;
        group += term.information;
      }
      shared.information += group;
    }
    shared.estimate = solve_common(X_CW, shared.information);
  }
  return shared;
}

template <class Model>
CommonEstimate what_others_say(const Model& model, const SharedPose& shared, const Pose& X_CW,
                               const CommonMatch& match) noexcept {
  CommonInformation others = shared.information;
  others -= linearise(model, shared.linearised_at, match).information;
  return solve_common(X_CW, others);
}

Matrix2d common_noise(const CommonJacobian& J_s, const CommonMatrix& covariance) noexcept {
  Matrix2d noise = J_s * covariance * J_s.transpose();
  noise(0, 1) = noise(1, 0) = 0.5 * (noise(0, 1) + noise(1, 0));
  return noise;
}

template CommonTerm linearise(const PixelModel&, const CommonEstimate&, const CommonMatch&) noexcept;
template SharedPose estimate_shared_pose(const PixelModel&, const Pose&, const CommonInformation&,
                                         std::span<const CommonMatch>, std::span<std::uint8_t>,
                                         const SharedPoseSettings&) noexcept;
template CommonEstimate what_others_say(const PixelModel&, const SharedPose&, const Pose&, const CommonMatch&) noexcept;
template CommonTerm linearise(const BearingModel&, const CommonEstimate&, const CommonMatch&) noexcept;
template SharedPose estimate_shared_pose(const BearingModel&, const Pose&, const CommonInformation&,
                                         std::span<const CommonMatch>, std::span<std::uint8_t>,
                                         const SharedPoseSettings&) noexcept;
template CommonEstimate what_others_say(const BearingModel&, const SharedPose&, const Pose&,
                                        const CommonMatch&) noexcept;

}  // namespace perimap
