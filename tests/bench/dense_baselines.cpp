#include "dense_baselines.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace perimap::bench {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using DenseJacobian = Eigen::Matrix<double, 2, Eigen::Dynamic>;

// z - h(x) and H = dz/dx.
Vector2d linearise(const VectorXd& x, const Observation& o, const PixelModel& model, DenseJacobian& H) {
  Vector2d z = Vector2d::Zero();
  MeasurementJacobians J;
  (void)measure(model, o.X_CW, position_of(x, o.b), z, &J);
  const Eigen::Index n = o.b.size();
  for (int axis = 0; axis < 3; ++axis) H.middleCols(axis * n, n).noalias() = J.dz_dp.col(axis) * o.b.transpose();
  return o.z - z;
}

}  // namespace

void paper_update(FeatureEstimate& estimate, const Observation& o, const PixelModel& model, int iterations) {
  const Eigen::Index d = estimate.x.size();
  const MatrixXd P_inverse = MatrixXd(estimate.P).llt().solve(MatrixXd::Identity(d, d));
  const Matrix2d R_inverse = o.R.inverse();
  VectorXd x = estimate.x;
  DenseJacobian H(2, d);
  MatrixXd A(d, d);
  for (int i = 0; i < iterations; ++i) {
    const Vector2d r = linearise(x, o, model, H);
    const DenseJacobian weighted = R_inverse * H;
    A = P_inverse;
    A.noalias() += H.transpose() * weighted;
    x += A.llt().solve(weighted.transpose() * r - P_inverse * (x - estimate.x));
  }
  (void)linearise(x, o, model, H);
  A = P_inverse;
  A.noalias() += H.transpose() * (R_inverse * H);
  estimate.x = x;
  estimate.P = A.llt().solve(MatrixXd::Identity(d, d));
  // Otherwise it drifts from symmetry until the factorisation fails.
  const MatrixXd symmetric = 0.5 * (estimate.P + estimate.P.transpose());
  estimate.P = symmetric;
}

void kalman_update(FeatureEstimate& estimate, const Observation& o, const PixelModel& model, int iterations) {
  const Eigen::Index d = estimate.x.size();
  VectorXd x = estimate.x;
  DenseJacobian H(2, d);
  Eigen::Matrix<double, Eigen::Dynamic, 2> PHt(d, 2);
  Matrix2d innovation_covariance;
  for (int i = 0; i <= iterations; ++i) {
    const Vector2d r = linearise(x, o, model, H);
    PHt.noalias() = estimate.P * H.transpose();
    innovation_covariance = H * PHt + o.R;
    if (i == iterations) break;
    x = estimate.x + PHt * innovation_covariance.llt().solve(r - H * (estimate.x - x));
  }
  const Eigen::Matrix<double, Eigen::Dynamic, 2> U =
      innovation_covariance.llt().matrixL().solve(PHt.transpose()).transpose();
  estimate.x = x;
  estimate.P.noalias() -= U * U.transpose();
}

}  // namespace perimap::bench
