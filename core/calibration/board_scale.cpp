#include "core/calibration/board_scale.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

namespace perimap {
namespace {

using ScaleMatrix = Eigen::Matrix<double, 6, 6>;

constexpr int kScale = 12;  // after X_SC and X_WB
constexpr int kOffset = 13;

// How (rotation, translation) of a small step in the frame B looks in the frame A.
ScaleMatrix carried(const Pose& X_AB) {
  ScaleMatrix by = ScaleMatrix::Zero();
  by.topLeftCorner<3, 3>() = X_AB.R;
  by.bottomRightCorner<3, 3>() = X_AB.R;
  by.bottomLeftCorner<3, 3>() = cross_matrix(X_AB.t) * X_AB.R;
  return by;
}

}  // namespace

BoardScale board_scale(const std::vector<PosePair>& pairs, const std::vector<char>& used, const Pose& X_SC,
                       const Pose& X_WB, const ScaleMatrix& error_covariance, double correlation_length,
                       bool with_offset) {
  const int count = with_offset ? kOffset + 1 : kScale + 1;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd b = Eigen::VectorXd::Zero(count);
  const Eigen::LLT<ScaleMatrix> weight(error_covariance);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (used[i] == 0) continue;
    const PosePair& pair = pairs[i];
    const Pose X_SB = pair.X_WS.inverse() * X_WB;
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, count);
    J.leftCols<6>() = -carried(X_SC);
    J.middleCols<6>(6) = carried(X_SB);
    J.block<3, 1>(3, kScale) = X_SB.R * pair.X_BC.t;
    if (with_offset) J.col(kOffset) = pair.twist_S;
    const Eigen::MatrixXd weighted = weight.solve(J);
    H += J.transpose() * weighted;
    b -= weighted.transpose() * hand_eye_error(pair, X_SC, X_WB);
  }
  // In units in which each number weighs alike.
  BoardScale result;
  result.deviation = std::numeric_limits<double>::infinity();
  if (!(H.diagonal().minCoeff() > 0.0)) return result;
  const Eigen::VectorXd unit = H.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(unit.asDiagonal() * H * unit.asDiagonal());
  constexpr double kOpen = 1e-11;
  if (!(eigen.eigenvalues()[0] > kOpen)) return result;
  const Eigen::MatrixXd inverse = unit.asDiagonal() * eigen.eigenvectors() *
                                  eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose() *
                                  unit.asDiagonal();
  const Eigen::VectorXd step = inverse * b;
  result.ratio = 1.0 + step[kScale];
  result.deviation = std::sqrt(correlation_length * inverse(kScale, kScale));
  result.change_C = inverse.block<6, 1>(0, kScale) / inverse(kScale, kScale) * step[kScale];
  return result;
}

}  // namespace perimap
