#include "daemon/setup/hand_eye_adjustment.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Dense>
#include <array>

namespace perimap {
namespace {

constexpr int kParameters = 13;  // X_SC, X_WB, time offset

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;

template <class T>
Matrix3<T> rotation_of(const Vector3<T>& w) {
  Matrix3<T> R;
  ceres::AngleAxisToRotationMatrix(w.data(), R.data());
  return R;
}

// hand_eye_error() at X_SC exp(d_SC), X_WB exp(d_WB) and the sensor's pose of another time, whitened.
class PoseError {
 public:
  PoseError(const PosePair& pair, const Pose& X_SC, const Pose& X_WB, const Matrix6d& whitening)
      : X_SB_(pair.X_WS.inverse() * X_WB),
        X_BC_(pair.X_BC),
        X_CS_(X_SC.inverse()),
        twist_(pair.twist_S),
        whitening_(whitening) {}

  template <class T>
  bool operator()(const T* d_SC, const T* d_WB, const T* d_offset, T* residual) const {
    using V = Vector3<T>;
    using M = Matrix3<T>;
    const Eigen::Map<const V> w_SC(d_SC), v_SC(d_SC + 3), w_WB(d_WB), v_WB(d_WB + 3);
    // A later offset asks for an earlier pose of the sensor: X_WS exp(-d twist), and its inverse.
    const M R_time = rotation_of<T>(d_offset[0] * twist_.head<3>().cast<T>());
    const V t_time = d_offset[0] * twist_.tail<3>().cast<T>();
    // exp(d twist) X_SB exp(d_WB) X_BC exp(d_SC)^-1 X_CS
    const M R_SC = rotation_of<T>(V(w_SC)).transpose();
    const V t_SC = -(R_SC * v_SC);
    M R = R_SC * X_CS_.R.cast<T>();
    V t = R_SC * X_CS_.t.cast<T>() + t_SC;
    t = X_BC_.R.cast<T>() * t + X_BC_.t.cast<T>();
    R = X_BC_.R.cast<T>() * R;
    const M R_WB = rotation_of<T>(V(w_WB));
    t = R_WB * t + v_WB;
    R = R_WB * R;
    t = X_SB_.R.cast<T>() * t + X_SB_.t.cast<T>();
    R = X_SB_.R.cast<T>() * R;
    t = R_time * t + t_time;
    R = R_time * R;
    Eigen::Matrix<T, 6, 1> e;
    V w;
    ceres::RotationMatrixToAngleAxis(R.data(), w.data());
    e << w, t;
    Eigen::Map<Eigen::Matrix<T, 6, 1>>(residual, 6, 1) = whitening_.cast<T>() * e;
    return true;
  }

 private:
  Pose X_SB_;
  Pose X_BC_;
  Pose X_CS_;
  Vector6d twist_;
  Matrix6d whitening_;
};

// The inverse of the normal equations, in units in which each parameter weighs alike; none when a direction is open.
void take_covariance(ceres::Problem& problem, const std::vector<double*>& blocks, HandEyeAdjustment& result) {
  ceres::Problem::EvaluateOptions options;
  options.parameter_blocks = blocks;  // one that is held constant has columns of zeros
  ceres::CRSMatrix J;
  problem.Evaluate(options, nullptr, nullptr, nullptr, &J);
  Eigen::Matrix<double, kParameters, kParameters> H = Eigen::Matrix<double, kParameters, kParameters>::Zero();
  for (int row = 0; row < J.num_rows; ++row) {
    for (int a = J.rows[static_cast<std::size_t>(row)]; a < J.rows[static_cast<std::size_t>(row) + 1]; ++a) {
      for (int b = J.rows[static_cast<std::size_t>(row)]; b < J.rows[static_cast<std::size_t>(row) + 1]; ++b) {
        H(J.cols[static_cast<std::size_t>(a)], J.cols[static_cast<std::size_t>(b)]) +=
            J.values[static_cast<std::size_t>(a)] * J.values[static_cast<std::size_t>(b)];
      }
    }
  }
  const int count = H(kParameters - 1, kParameters - 1) > 0.0 ? kParameters : kParameters - 1;
  const Eigen::MatrixXd used = H.topLeftCorner(count, count);
  if (!(used.diagonal().minCoeff() > 0.0)) return;
  const Eigen::VectorXd scale = used.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * used * scale.asDiagonal());
  constexpr double kOpen = 1e-11;
  if (!(eigen.eigenvalues()[0] > kOpen)) return;
  const Eigen::MatrixXd inverse = scale.asDiagonal() * eigen.eigenvectors() *
                                  eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose() *
                                  scale.asDiagonal();
  result.covariance.topLeftCorner<6, 6>() = inverse.topLeftCorner<6, 6>();
  if (count == kParameters) {
    result.covariance.topRightCorner<6, 1>() = inverse.block<6, 1>(0, kParameters - 1);
    result.covariance.bottomLeftCorner<1, 6>() = inverse.block<1, 6>(kParameters - 1, 0);
    result.covariance(6, 6) = inverse(kParameters - 1, kParameters - 1);
  }
  result.converged = true;
}

}  // namespace

HandEyeAdjustment adjust_hand_eye(const std::vector<PosePair>& pairs, const std::vector<char>& used, const Pose& X_SC,
                                  const Pose& X_WB, const Matrix6d& error_covariance, bool estimate_offset) {
  const Matrix6d whitening = Matrix6d(error_covariance.llt().matrixL()).inverse();
  std::array<double, 6> d_SC{};
  std::array<double, 6> d_WB{};
  std::array<double, 1> d_offset{};
  ceres::Problem problem;
  problem.AddParameterBlock(d_SC.data(), 6);
  problem.AddParameterBlock(d_WB.data(), 6);
  problem.AddParameterBlock(d_offset.data(), 1);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (used[i] == 0) continue;
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PoseError, 6, 6, 6, 1>(new PoseError(pairs[i], X_SC, X_WB, whitening)), nullptr,
        d_SC.data(), d_WB.data(), d_offset.data());
  }
  if (!estimate_offset) problem.SetParameterBlockConstant(d_offset.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 50;
  options.function_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);

  HandEyeAdjustment result;
  const Eigen::Map<const Vector6d> SC(d_SC.data()), WB(d_WB.data());
  result.X_SC = X_SC * Pose{so3_exp(SC.head<3>()), SC.tail<3>()};
  result.X_WB = X_WB * Pose{so3_exp(WB.head<3>()), WB.tail<3>()};
  result.offset_change_s = d_offset[0];
  result.error_covariance = error_covariance;
  if (summary.IsSolutionUsable()) take_covariance(problem, {d_SC.data(), d_WB.data(), d_offset.data()}, result);
  return result;
}

}  // namespace perimap
