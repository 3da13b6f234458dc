#include "core/estimation/correlated_pose_noise.hpp"

#include <Eigen/LU>

namespace perimap {

CorrelatedPoseNoise::CorrelatedPoseNoise(Eigen::Index state_size)
    : recent_(Gain::Zero(state_size, 6)), V_(StateMatrix::Zero(state_size, state_size)) {}

void CorrelatedPoseNoise::add(const Basis& b, const Matrix23d& dz_dp, const Matrix2d& R, const Matrix26d& J_s,
                              const Matrix6d& sigma, double kept) noexcept {
  const Eigen::Index n = b.size();
  const Eigen::Matrix<double, 3, 6> at_position = dz_dp.transpose() * (R.inverse() * J_s);
  Gain A(3 * n, 6);
  for (Eigen::Index axis = 0; axis < 3; ++axis) A.middleRows(axis * n, n).noalias() = b * at_position.row(axis);
  recent_ *= kept;
  const Gain A_sigma = A.lazyProduct(sigma);
  StateMatrix product(3 * n, 3 * n);
  product.noalias() = A_sigma.lazyProduct(recent_.transpose());
  V_ += product;
  V_ += product.transpose();
  recent_ += A;
}

StateMatrix CorrelatedPoseNoise::enlarged(const StateMatrix& P) const noexcept {
  StateMatrix PV(P.rows(), P.cols());
  StateMatrix larger(P.rows(), P.cols());
  PV.noalias() = P.lazyProduct(V_);
  larger.noalias() = PV.lazyProduct(P);
  larger = 0.5 * (larger + larger.transpose()).eval();
  larger += P;
  return larger;
}

}  // namespace perimap
