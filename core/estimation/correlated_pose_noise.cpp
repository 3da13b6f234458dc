#include "core/estimation/correlated_pose_noise.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace perimap {
namespace {

using Columns2 = Eigen::Matrix<double, Eigen::Dynamic, 2, 0, kMaxState, 2>;

// K = P H^T R^-1, which holds for P after the update.
Columns2 gain_of(const PoseNoiseTerm& term) noexcept {
  return term.M.lazyProduct(term.dz_dp.transpose() * term.R.inverse());
}

// B A (3 x columns).
template <int kColumns>
Eigen::Matrix<double, 3, kColumns> position_rows(
    const Basis& b, const Eigen::Matrix<double, Eigen::Dynamic, kColumns, 0, kMaxState, kColumns>& A) noexcept {
  const Eigen::Index n = b.size();
  Eigen::Matrix<double, 3, kColumns> rows;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    rows.row(axis).noalias() = b.transpose().lazyProduct(A.middleRows(axis * n, n));
  }
  return rows;
}

void add_symmetric(const Columns2& W, const Columns2& K, StateMatrix& C) noexcept {
  for (Eigen::Index j = 0; j < C.cols(); ++j) {
    C.col(j) += W.col(0) * K(j, 0) + W.col(1) * K(j, 1) + K.col(0) * W(j, 0) + K.col(1) * W(j, 1);
  }
}

}  // namespace

CorrelatedPoseNoise::CorrelatedPoseNoise(Eigen::Index state_size, double correlation_s) noexcept
    : correlation_s_(correlation_s), C_(StateMatrix::Zero(state_size, state_size)), X_(Gain::Zero(state_size, 6)) {}

void CorrelatedPoseNoise::reset() noexcept {
  C_.setZero();
  X_.setZero();
}

void CorrelatedPoseNoise::add(const PoseNoiseTerm& term) noexcept {
  const Columns2 K = gain_of(term);
  const Columns2 CH = position_gain(C_, term.b).lazyProduct(term.dz_dp.transpose());  // C H^T
  const Matrix2d HCH = term.dz_dp * position_rows(term.b, CH);
  const Matrix26d HX = term.dz_dp * position_rows(term.b, X_);
  const Eigen::Matrix<double, 6, 2> sigma_J = term.sigma * term.dz_ds.transpose();
  const Columns2 Z = X_.lazyProduct(sigma_J);  // E e s^T J^T, before the update
  const Matrix2d HZ = HX * sigma_J;
  // (I - K H) C (I - K H)^T + (I - K H) Z K^T + K Z^T (I - K H)^T = C + W K^T + K W^T
  const Matrix2d within_K = 0.5 * HCH - HZ;
  const Columns2 W = Z - CH + K.lazyProduct(within_K);
  add_symmetric(W, K, C_);
  const Matrix26d seen_anew = term.dz_ds - HX;
  X_ += K.lazyProduct(seen_anew);
}

void CorrelatedPoseNoise::add_of_batch(const PoseNoiseTerm& term) noexcept {
  const Columns2 K = gain_of(term);
  const Eigen::Matrix<double, 6, 2> sigma_J = term.sigma * term.dz_ds.transpose();
  const Columns2 Z = X_.lazyProduct(sigma_J);
  add_symmetric(Z, K, C_);
  X_ += K.lazyProduct(term.dz_ds);
}

Matrix3d CorrelatedPoseNoise::position_covariance(const Basis& b) const noexcept {
  Eigen::SelfAdjointEigenSolver<Matrix3d> solver;
  solver.computeDirect(perimap::position_covariance(C_, b));
  const Vector3d variances = solver.eigenvalues().cwiseMax(0.0);
  return solver.eigenvectors() * variances.asDiagonal() * solver.eigenvectors().transpose();
}

}  // namespace perimap
