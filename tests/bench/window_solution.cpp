#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "dense_baselines.hpp"

namespace perimap::bench {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

class Sighting : public ceres::CostFunction {
 public:
  Sighting(const Observation& observation, const PixelModel& model, int d)
      : observation_(observation), model_(model), whitening_(Matrix2d(observation.R.inverse().llt().matrixU())) {
    set_num_residuals(2);
    mutable_parameter_block_sizes()->push_back(d);
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index n = observation_.b.size();
    const StateVector x = Eigen::Map<const VectorXd>(parameters[0], 3 * n);
    Vector2d z;
    MeasurementJacobians J;
    if (measure(model_, observation_.X_CW, position_of(x, observation_.b), z, &J) != ProjectionStatus::kOk)
      return false;
    Eigen::Map<Vector2d>(residuals).noalias() = whitening_ * (z - observation_.z);
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Map<Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor>> H(jacobians[0], 2, 3 * n);
    const Matrix23d J_white = whitening_ * J.dz_dp;
    for (int axis = 0; axis < 3; ++axis) {
      H.middleCols(axis * n, n).noalias() = J_white.col(axis) * observation_.b.transpose();
    }
    return true;
  }

 private:
  const Observation& observation_;
  const PixelModel& model_;
  Matrix2d whitening_;
};

class GaussianPrior : public ceres::CostFunction {
 public:
  explicit GaussianPrior(const FeatureEstimate& prior)
      : mean_(prior.x), whitening_(MatrixXd(prior.P.inverse()).llt().matrixU()) {
    const int d = static_cast<int>(prior.x.size());
    set_num_residuals(d);
    mutable_parameter_block_sizes()->push_back(d);
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index d = mean_.size();
    Eigen::Map<VectorXd>(residuals, d) = whitening_ * (Eigen::Map<const VectorXd>(parameters[0], d) - mean_);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(jacobians[0], d, d) =
          whitening_;
    }
    return true;
  }

 private:
  VectorXd mean_;
  MatrixXd whitening_;
};

}  // namespace

int window_solution(StateVector& x, const FeatureEstimate& prior, const std::vector<Observation>& observations,
                    const PixelModel& model) {
  const int d = static_cast<int>(x.size());
  VectorXd solution = x;
  ceres::Problem problem;
  problem.AddResidualBlock(new GaussianPrior(prior), nullptr, solution.data());
  for (const Observation& observation : observations) {
    problem.AddResidualBlock(new Sighting(observation, model, d), nullptr, solution.data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = 3;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  x = solution;
  return summary.num_successful_steps;
}

}  // namespace perimap::bench
