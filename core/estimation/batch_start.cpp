#include "core/estimation/batch_start.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/estimation/student_t_loss.hpp"

namespace perimap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

enum class Loss : std::uint8_t { kQuadratic, kHuber, kStudentT };

// rho(s) of the squared Mahalanobis residual s, and its derivative, the observation's weight.
struct LossValue {
  double rho;
  double weight;
};

LossValue loss_of(Loss loss, double s, double huber_deviations) noexcept {
  switch (loss) {
    case Loss::kQuadratic:
      break;
    case Loss::kHuber: {
      const double radius = std::sqrt(s);
      if (radius <= huber_deviations) break;
      return {huber_deviations * (2.0 * radius - huber_deviations), huber_deviations / radius};
    }
    case Loss::kStudentT:
      return {student_t_loss(s), student_t_weight(s)};
  }
  return {s, 1.0};
}

// A squared residual stands in for an observation in which the feature can't be seen from where it is supposed to be: a
// thousand deviations, without a gradient. So a start on the wrong side of one camera is bad but not lost.
constexpr double kInvisible = 1e6;

// Mean of the Student-t loss beside that of residuals which are as large as they are said to be: (nu + 2) e^a E_1(a)
// with a = nu / 2. Some gross outliers do not add much to it.
double misfit_of(std::span<const double> residual2) {
  constexpr double kExpected = 2.2417;
  double sum = 0.0;
  for (const double s : residual2) sum += student_t_loss(s);
  return sum / (kExpected * static_cast<double>(residual2.size()));
}

// The cost J(y) = |y|^2 + sum_k rho_k in coordinates whitened by the prior, x = x_0 + sigma y. There the Hessian is I +
// sum_k w_k B_k^T G_k B_k with G = J^T R^-1 J (3x3): six scalars an observation times b b^T.
template <class Model>
class BatchProblem {
 public:
  BatchProblem(std::span<const Observation> observations, const Model& model, const Basis& deviations,
               const Vector3d& prior_mean, double huber_deviations)
      : observations_(observations),
        model_(model),
        prior_mean_(prior_mean),
        huber_deviations_(huber_deviations),
        n_(deviations.size()),
        deviations_(deviations),
        scaled_basis_(n_, static_cast<Index>(observations.size())),
        R_(observations.size()),
        R_inverse_(observations.size()),
        used_(observations.size(), 1),
        residual2_(observations.size(), 0.0),
        weight_(observations.size(), 0.0) {
    for (Index k = 0; k < count(); ++k) {
      const Observation& observation = observations_[static_cast<std::size_t>(k)];
      scaled_basis_.col(k) = deviations.cwiseProduct(observation.b);
      set_covariance(k, observation.R);
    }
    g_.resize(count(), 3);
    G_.resize(count(), 6);
    weighted_basis_.resize(6 * n_, count());
  }

  [[nodiscard]] Index count() const noexcept { return scaled_basis_.cols(); }
  [[nodiscard]] Index dimension() const noexcept { return 3 * n_; }

  // What the phases' deviations make of each observation of the feature that moves as at y comes to its R.
  void widen(const VectorXd& y) {
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>> coefficients(y.data(), n_, 3);
    for (Index k = 0; k < count(); ++k) {
      const Observation& observation = observations_[static_cast<std::size_t>(k)];
      if (observation.b_deviation.size() != n_) continue;
      Vector2d z;
      Matrix23d dz_dq;
      const Vector3d p = prior_mean_ + coefficients.transpose() * scaled_basis_.col(k);
      if (model_.predict(observation.X_CW * p, z, &dz_dq) != ProjectionStatus::kOk) continue;
      const Vector3d displaced = coefficients.transpose() * deviations_.cwiseProduct(observation.b_deviation);
      const Vector2d spread = dz_dq * (observation.X_CW.R * displaced);
      set_covariance(k, observation.R + spread * spread.transpose());
    }
  }

  // What each observation counts with, without the variance scale.
  [[nodiscard]] const std::vector<Matrix2d>& R() const noexcept { return R_; }
  // Every R times this; 1 at first.
  void set_variance_scale(double scale) noexcept { variance_scale_ = scale; }
  // Which observations count, 1 or 0; the caller decides.
  [[nodiscard]] std::vector<std::uint8_t>& used() noexcept { return used_; }
  // At the y last evaluated:
  [[nodiscard]] const std::vector<double>& residual2() const noexcept { return residual2_; }
  [[nodiscard]] const std::vector<double>& weight() const noexcept { return weight_; }
  [[nodiscard]] int visible() const noexcept { return visible_; }

  // J(y); leaves residuals, weights and, for normal_equations(), the first derivatives at y.
  double evaluate(const VectorXd& y, Loss loss) {
    double cost = y.squaredNorm();
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>> coefficients(y.data(), n_, 3);
    visible_ = 0;
    for (Index k = 0; k < count(); ++k) {
      const auto index = static_cast<std::size_t>(k);
      const Observation& observation = observations_[index];
      const Vector3d p = prior_mean_ + coefficients.transpose() * scaled_basis_.col(k);
      Vector2d z;
      Matrix23d dz_dq;
      const bool seen = model_.predict(observation.X_CW * p, z, &dz_dq) == ProjectionStatus::kOk;
      visible_ += seen ? 1 : 0;
      double s = kInvisible;
      Vector2d Wr = Vector2d::Zero();
      if (seen) {
        const Vector2d r = model_.residual(observation.z, z);
        Wr = R_inverse_[index] * r;
        s = r.dot(Wr);
      }
      residual2_[index] = s;
      if (used_[index] == 0) {
        g_.row(k).setZero();
        G_.row(k).setZero();
        continue;
      }
      const LossValue value = loss_of(loss, s / variance_scale_, huber_deviations_);
      cost += value.rho;
      weight_[index] = value.weight / variance_scale_;
      if (!seen) {
        g_.row(k).setZero();
        G_.row(k).setZero();
        continue;
      }
      const Matrix23d J = dz_dq * observation.X_CW.R;
      const Matrix23d WJ = weight_[index] * (R_inverse_[index] * J);
      const Matrix3d G = J.transpose() * WJ;
      g_.row(k) = weight_[index] * (J.transpose() * Wr).transpose();
      G_.row(k) << G(0, 0), G(1, 0), G(2, 0), G(1, 1), G(2, 1), G(2, 2);
    }
    return cost;
  }

  // Half the Hessian (Gauss-Newton, lower triangle) and minus half the gradient at the y last evaluated.
  void normal_equations(const VectorXd& y, MatrixXd& A, VectorXd& descent) {
    // The six n x n blocks by one matrix product.
    for (Index block = 0; block < 6; ++block) {
      weighted_basis_.middleRows(block * n_, n_).noalias() = scaled_basis_ * G_.col(block).asDiagonal();
    }
    blocks_.noalias() = weighted_basis_ * scaled_basis_.transpose();
    A.resize(dimension(), dimension());
    Index block = 0;
    for (Index column = 0; column < 3; ++column) {
      for (Index row = column; row < 3; ++row, ++block) {
        A.block(row * n_, column * n_, n_, n_) = blocks_.middleRows(block * n_, n_);
      }
    }
    A.diagonal().array() += 1.0;
    descent = -y;
    for (Index axis = 0; axis < 3; ++axis) descent.segment(axis * n_, n_) += scaled_basis_ * g_.col(axis);
  }

 private:
  void set_covariance(Index k, const Matrix2d& R) {
    const auto index = static_cast<std::size_t>(k);
    R_[index] = R;
    R_inverse_[index] = R.inverse();
  }

  std::span<const Observation> observations_;
  const Model& model_;
  Vector3d prior_mean_;
  double huber_deviations_;
  Index n_;
  Basis deviations_;
  MatrixXd scaled_basis_;  // n x K: sigma o b of each observation
  std::vector<Matrix2d> R_;
  std::vector<Matrix2d> R_inverse_;
  Eigen::Matrix<double, Eigen::Dynamic, 3> g_;  // J^T R^-1 r w
  Eigen::Matrix<double, Eigen::Dynamic, 6> G_;  // xx, yx, zx, yy, zy, zz of J^T R^-1 J w
  MatrixXd weighted_basis_;
  MatrixXd blocks_;
  double variance_scale_ = 1.0;
  std::vector<std::uint8_t> used_;
  std::vector<double> residual2_;
  std::vector<double> weight_;
  int visible_ = 0;
};

struct Solution {
  VectorXd y;
  double cost = 0.0;
  bool converged = false;
};

// Levenberg-Marquardt (Marquardt's damping after Nielsen, IMM-REP-1999-05) from y. Ends when the cost can fall by no
// more than `tolerance`, which is the squared length of the step in posterior deviations.
template <class Model>
Solution minimise(BatchProblem<Model>& problem, VectorXd y, Loss loss, int max_iterations, double tolerance,
                  int& iterations) {
  Solution solution;
  MatrixXd A;
  MatrixXd damped;
  VectorXd descent;
  double cost = problem.evaluate(y, loss);
  problem.normal_equations(y, A, descent);
  constexpr double kFirstDamping = 1e-6;
  double mu = kFirstDamping * A.diagonal().maxCoeff();
  double growth = 2.0;
  for (int i = 0; i < max_iterations && std::isfinite(cost); ++i) {
    ++iterations;
    damped = A;
    damped.diagonal().array() += mu;
    const Eigen::LLT<Eigen::Ref<MatrixXd>> factor(damped);
    if (factor.info() != Eigen::Success) break;
    const VectorXd step = factor.solve(descent);
    const double expected = step.dot(mu * step + descent);
    const VectorXd trial = y + step;
    const double trial_cost = problem.evaluate(trial, loss);
    // As in the recursive update: rounding must not stop the last steps.
    const double slack = 1e-9 * (1.0 + cost);
    if (trial_cost <= cost + slack) {
      const double gain = expected > slack ? (cost - trial_cost) / expected : 1.0;
      const double turn = 2.0 * gain - 1.0;
      mu *= std::max(expected > slack ? 1.0 / 10.0 : 1e-3, 1.0 - turn * turn * turn);
      growth = 2.0;
      y = trial;
      cost = trial_cost;
      problem.normal_equations(y, A, descent);
      if (expected < tolerance) {
        solution.converged = true;
        break;
      }
    } else {
      if (expected < tolerance) {
        // No further descent: y is the minimum to rounding, unless damping alone has made the step so short.
        const Eigen::LLT<MatrixXd> undamped(A);
        solution.converged = undamped.info() == Eigen::Success && descent.dot(undamped.solve(descent)) < tolerance;
        break;
      }
      mu *= growth;
      growth *= 2.0;
    }
  }
  solution.cost = problem.evaluate(y, loss);
  solution.y = std::move(y);
  solution.converged = solution.converged && std::isfinite(solution.cost);
  return solution;
}

// Student's t from y, with every R first enlarged and then brought back in steps (graduated non-convexity, Blake &
// Zisserman, Visual Reconstruction, 1987). Against a large R the prior is stiff, so that the curve can't bend to an
// outlier at a phase that few observations share; from the plain robust solution it would never let go of it again.
template <class Model>
Solution graduate(BatchProblem<Model>& problem, VectorXd y, int max_iterations, double tolerance, int& iterations) {
  Solution solution;
  solution.y = std::move(y);
  for (const double scale : {256.0, 64.0, 16.0, 4.0, 1.0}) {
    problem.set_variance_scale(scale);
    solution = minimise(problem, std::move(solution.y), Loss::kStudentT, max_iterations, tolerance, iterations);
  }
  return solution;
}

template <class Model>
bool usable(const Observation& observation, const Model&, int n) noexcept {
  return observation.b.size() == n && observation.b.allFinite() && observation.z.allFinite() &&
         observation.R.allFinite() && observation.R(0, 0) > 0.0 && observation.R.determinant() > 0.0 &&
         (observation.b_deviation.size() == 0 ||
          (observation.b_deviation.size() == n && observation.b_deviation.allFinite())) &&
         observation.X_CW.R.allFinite() && observation.X_CW.t.allFinite();
}

// The rough solutions only choose the basin.
constexpr double kRough = 1e-3;

// From one start through the robust losses; none when another start has led to the same place.
template <class Model>
std::optional<Solution> descend(BatchProblem<Model>& problem, VectorXd y, const BatchSettings& settings,
                                std::vector<Solution>& rough_solutions, int& iterations) {
  const Loss first_loss = settings.robust ? Loss::kHuber : Loss::kQuadratic;
  Solution solution = minimise(problem, std::move(y), first_loss, settings.max_iterations, kRough, iterations);
  if (!settings.robust) return solution;
  // Two starts that meet need not go on twice.
  const bool known = std::any_of(rough_solutions.begin(), rough_solutions.end(), [&](const Solution& other) {
    return (solution.y - other.y).squaredNorm() < 1e-4 * static_cast<double>(problem.dimension()) &&
           std::abs(solution.cost - other.cost) < 0.1;
  });
  if (known) return std::nullopt;
  rough_solutions.push_back(solution);
  VectorXd huber_y = solution.y;
  solution = minimise(problem, std::move(solution.y), Loss::kStudentT, settings.max_iterations, kRough, iterations);
  // Without an outlier there is nothing to be caught by.
  const bool outliers = std::any_of(problem.residual2().begin(), problem.residual2().end(),
                                    [&](double s) { return !(s < settings.gate); });
  if (outliers) {
    Solution other = graduate(problem, std::move(huber_y), settings.max_iterations, kRough, iterations);
    if (other.converged && (!solution.converged || other.cost < solution.cost)) solution = std::move(other);
  }
  return solution;
}

// The best that the starts at all depths lead to. `offset_of` tells where a depth lies, from the prior's mean.
template <class Model, class OffsetOf>
BatchStatus best_of_starts(BatchProblem<Model>& problem, const OffsetOf& offset_of, double dc_deviation_mm, Index n,
                           const BatchSettings& settings, int& iterations, Solution& best) {
  std::vector<Solution> rough_solutions;
  bool seen_somewhere = false;
  bool any = false;
  for (const double depth_mm : settings.start_depths_mm) {
    VectorXd y = VectorXd::Zero(problem.dimension());
    const Vector3d offset = offset_of(depth_mm);
    for (Index axis = 0; axis < 3; ++axis) y(axis * n) = offset(axis) / dc_deviation_mm;
    problem.evaluate(y, settings.robust ? Loss::kHuber : Loss::kQuadratic);
    if (problem.visible() == 0) continue;
    seen_somewhere = true;
    std::optional<Solution> solution = descend(problem, std::move(y), settings, rough_solutions, iterations);
    if (!solution || !solution->converged || (any && !(solution->cost < best.cost))) continue;
    best = *std::move(solution);
    any = true;
  }
  if (!seen_somewhere) return BatchStatus::kBehindCamera;
  return any ? BatchStatus::kOk : BatchStatus::kDiverged;
}

template <class Model>
int count_inliers(BatchProblem<Model>& problem) {
  return static_cast<int>(std::count(problem.used().begin(), problem.used().end(), 1));
}

// The plain estimate of what lies within the gate, until that set stays. One that has come in stays in, so that the set
// can't alternate.
template <class Model>
BatchStatus refine(BatchProblem<Model>& problem, const BatchSettings& settings, Solution& solution,
                   BatchOutcome& outcome) {
  const std::size_t count = problem.residual2().size();
  const int enough = std::max(settings.min_observations,
                              static_cast<int>(std::ceil(settings.min_inlier_fraction * static_cast<double>(count))));
  problem.widen(solution.y);
  if (settings.robust) {
    outcome.robust_cost = problem.evaluate(solution.y, Loss::kStudentT);
    outcome.weights = problem.weight();
    for (std::size_t k = 0; k < count; ++k) problem.used()[k] = problem.residual2()[k] < settings.gate ? 1 : 0;
    outcome.misfit = misfit_of(problem.residual2());
  } else {
    problem.evaluate(solution.y, Loss::kQuadratic);
    outcome.weights = problem.weight();
  }
  constexpr int kMaxRounds = 5;
  for (int round = 0; round < kMaxRounds; ++round) {
    if (count_inliers(problem) < enough) return BatchStatus::kTooManyOutliers;
    solution = minimise(problem, std::move(solution.y), Loss::kQuadratic, settings.max_iterations, settings.tolerance,
                        outcome.iterations);
    if (!solution.converged) return BatchStatus::kDiverged;
    if (!settings.robust) break;
    bool changed = false;
    for (std::size_t k = 0; k < count; ++k) {
      if (problem.used()[k] == 0 && problem.residual2()[k] < settings.gate) {
        problem.used()[k] = 1;
        changed = true;
      }
    }
    if (!changed) break;
  }
  if (!settings.robust) outcome.robust_cost = solution.cost;
  return BatchStatus::kOk;
}

// State and covariance at the solution, out of the whitened coordinates. False when they are no numbers.
template <class Model>
bool estimate_at(BatchProblem<Model>& problem, const VectorXd& y, const Basis& deviations, const Vector3d& prior_mean,
                 BatchOutcome& outcome) {
  const Index n = deviations.size();
  const Index d = problem.dimension();
  MatrixXd A;
  VectorXd descent;
  outcome.map_cost = problem.evaluate(y, Loss::kQuadratic);
  problem.normal_equations(y, A, descent);
  const Eigen::LLT<MatrixXd> factor(A);
  if (factor.info() != Eigen::Success) return false;
  const MatrixXd P = factor.solve(MatrixXd::Identity(d, d));
  VectorXd sigma(d);
  for (Index axis = 0; axis < 3; ++axis) sigma.segment(axis * n, n) = deviations;
  FeatureEstimate& estimate = outcome.estimate;
  estimate.x = sigma.cwiseProduct(y);
  for (Index axis = 0; axis < 3; ++axis) estimate.x(axis * n) += prior_mean(axis);
  estimate.P.resize(d, d);
  for (Index j = 0; j < d; ++j) {
    for (Index i = j; i < d; ++i) {
      estimate.P(i, j) = estimate.P(j, i) = 0.5 * (P(i, j) + P(j, i)) * sigma(i) * sigma(j);
    }
  }
  return estimate.x.allFinite() && estimate.P.allFinite();
}

}  // namespace

template <class Model>
BatchOutcome batch_start(std::span<const Observation> observations, const Model& model, const BasisLayout& layout,
                         const Prior& prior, const BatchSettings& settings) {
  BatchOutcome outcome;
  const auto refuse = [&outcome](BatchStatus status) {
    outcome.status = status;
    return outcome;
  };
  if (observations.empty() || static_cast<int>(observations.size()) < settings.min_observations) {
    return refuse(BatchStatus::kTooFewObservations);
  }
  const int n = layout.size();
  for (const Observation& observation : observations) {
    if (!usable(observation, model, n)) return refuse(BatchStatus::kBadObservation);
  }
  Vector3d ray_C;
  if (!model.ray(observations.front().z, ray_C)) return refuse(BatchStatus::kBadObservation);
  const Pose X_WC = observations.front().X_CW.inverse();
  const Vector3d prior_mean = X_WC * (settings.prior_depth_mm * ray_C);
  const Basis deviations = prior_deviations(layout, prior);
  BatchProblem<Model> problem(observations, model, deviations, prior_mean, settings.huber_deviations);

  const auto offset_of = [&](double depth_mm) { return Vector3d(X_WC * (depth_mm * ray_C) - prior_mean); };
  Solution solution;
  const BatchStatus started =
      best_of_starts(problem, offset_of, deviations(0), n, settings, outcome.iterations, solution);
  if (started != BatchStatus::kOk) return refuse(started);
  const BatchStatus refined = refine(problem, settings, solution, outcome);
  if (refined != BatchStatus::kOk) return refuse(refined);
  if (!estimate_at(problem, solution.y, deviations, prior_mean, outcome)) return refuse(BatchStatus::kDiverged);
  outcome.inlier = problem.used();
  outcome.inliers = count_inliers(problem);
  outcome.R = problem.R();
  outcome.status = BatchStatus::kOk;
  return outcome;
}

template BatchOutcome batch_start(std::span<const Observation>, const PixelModel&, const BasisLayout&, const Prior&,
                                  const BatchSettings&);
template BatchOutcome batch_start(std::span<const Observation>, const BearingModel&, const BasisLayout&, const Prior&,
                                  const BatchSettings&);

}  // namespace perimap
