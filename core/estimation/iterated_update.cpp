#include "core/estimation/iterated_update.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace perimap {

UpdateStatus status_of(ProjectionStatus status) noexcept {
  switch (status) {
    case ProjectionStatus::kOk:
      return UpdateStatus::kAccepted;
    case ProjectionStatus::kBehindCamera:
      return UpdateStatus::kBehindCamera;
    case ProjectionStatus::kFoldedBack:
      return UpdateStatus::kFoldedBack;
    case ProjectionStatus::kNotFinite:
      return UpdateStatus::kNotFinite;
  }
  return UpdateStatus::kNotFinite;
}

namespace {

using Matrix32d = Eigen::Matrix<double, 3, 2>;
using PositionGain = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxState, 3>;    // M
using CovarianceStep = Eigen::Matrix<double, Eigen::Dynamic, 2, 0, kMaxState, 2>;  // U

// Cholesky factor of a symmetric 2x2 matrix, for solves. Only its lower triangle is read.
struct Cholesky2 {
  double l00 = 0.0;
  double l10 = 0.0;
  double l11 = 0.0;

  // False when A is not positive definite (or not finite).
  [[nodiscard]] bool factor(const Matrix2d& A) noexcept {
    if (!(A(0, 0) > 0.0)) return false;
    l00 = std::sqrt(A(0, 0));
    l10 = A(1, 0) / l00;
    const double rest = A(1, 1) - l10 * l10;
    if (!(rest > 0.0)) return false;
    l11 = std::sqrt(rest);
    return std::isfinite(l00) && std::isfinite(l10) && std::isfinite(l11);
  }
  // L^-1 v
  [[nodiscard]] Vector2d whiten(const Vector2d& v) const noexcept {
    const double w0 = v.x() / l00;
    return {w0, (v.y() - l10 * w0) / l11};
  }
  // A^-1 v
  [[nodiscard]] Vector2d solve(const Vector2d& v) const noexcept {
    const Vector2d w = whiten(v);
    const double s1 = w.y() / l11;
    return {(w.x() - l10 * s1) / l00, s1};
  }
};

// The model at one point of the iteration.
struct Linearisation {
  Vector2d r;   // z - h(p)
  Matrix23d J;  // dh/dp
  double cost = 0.0;
};

// What stays the same during an update: the measurement, and the prior at its phase.
template <class Model>
struct Problem {
  const Observation& observation;
  const Model& model;
  PositionGain M;
  Matrix3d S;
  Vector3d p_hat;
  Cholesky2 R_factor;

  // At p = p^ + S lambda.
  [[nodiscard]] ProjectionStatus linearise(const Vector3d& lambda, Linearisation& at) const noexcept {
    const Vector3d q = observation.X_CW * (p_hat + S * lambda);
    Vector2d z_predicted;
    Matrix23d dz_dq;
    const ProjectionStatus status = model.predict(q, z_predicted, &dz_dq);
    if (status != ProjectionStatus::kOk) return status;
    at.r = model.residual(observation.z, z_predicted);
    at.J.noalias() = dz_dq * observation.X_CW.R;
    at.cost = lambda.dot(S * lambda) + R_factor.whiten(at.r).squaredNorm();
    return std::isfinite(at.cost) ? ProjectionStatus::kOk : ProjectionStatus::kNotFinite;
  }
};

// What goes from step to step.
struct Iterate {
  Vector3d lambda = Vector3d::Zero();
  Linearisation now;
  Matrix23d J_before;  // of the iterate before the last
  double mu = 0.0;
  int count = 0;
  bool moved = false;
  ProjectionStatus last_failure = ProjectionStatus::kOk;
};

struct Step {
  Matrix23d JS;
  Vector3d trial;  // lambda after it
  double prior_length2 = 0.0;
  double length2 = 0.0;
};

// Of Levenberg-Marquardt in the metric of the prior, damping mu P^-1. The step D solves (1 + mu) D = J^T v - lambda
// with R v = r - J S D, hence ((1 + mu) R + J S J^T) v = (1 + mu) r + J S lambda. mu = 0 is Gauss-Newton. False when
// that matrix is not positive.
template <class Model>
bool next_step(const Problem<Model>& problem, const Iterate& it, double step_factor, Step& to) noexcept {
  const Linearisation& now = it.now;
  const double damping = 1.0 + it.mu;
  to.JS = now.J * problem.S;
  const Matrix2d A = damping * problem.observation.R + to.JS * now.J.transpose();
  Cholesky2 A_factor;
  if (!A_factor.factor(A)) return false;
  const Vector2d v = A_factor.solve(damping * now.r + to.JS * it.lambda);
  const Vector3d step = (step_factor / damping) * (now.J.transpose() * v - it.lambda);
  to.trial = it.lambda + step;
  // Squared length in posterior standard deviations, (P^-1 + H^T R^-1 H) being its inverse.
  to.prior_length2 = step.dot(problem.S * step);
  to.length2 = to.prior_length2 + problem.R_factor.whiten(to.JS * step).squaredNorm();
  return true;
}

// False when the cost does not fall. Either way the damping is that of the next step.
bool judge_damped(const Step& step, const Linearisation& next, ProjectionStatus status, Iterate& it) noexcept {
  // Near the minimum rounding decides whether the cost rises or falls; strict descent would stop at sqrt(epsilon).
  const double slack = 1e-9 * (1.0 + it.now.cost);
  if (status != ProjectionStatus::kOk || !(next.cost <= it.now.cost + slack)) {
    it.last_failure = status;
    it.mu = it.mu == 0.0 ? 1.0 : 4.0 * it.mu;
    return false;
  }
  // Where the curvature of h matters, Gauss-Newton overshoots and comes back: keep the damping that prevents it.
  const double expected_fall = step.length2 + 2.0 * it.mu * step.prior_length2;
  if (expected_fall > slack) {
    const double gain = (it.now.cost - next.cost) / expected_fall;
    if (gain < 0.25) {
      it.mu = it.mu == 0.0 ? 0.5 : 2.0 * it.mu;
    } else if (gain > 0.75) {
      it.mu = it.mu > 1e-2 ? 0.25 * it.mu : 0.0;
    }
  }
  return true;
}

template <class Model>
UpdateStatus iterate(const Problem<Model>& problem, const UpdateSettings& settings, Iterate& it) noexcept {
  const bool damped = settings.method == UpdateMethod::kLevenbergMarquardt;
  const double step_factor = damped ? 1.0 : settings.step_factor;
  it.J_before = it.now.J;
  while (it.count < settings.max_iterations) {
    ++it.count;
    Step step;
    if (!next_step(problem, it, step_factor, step)) return UpdateStatus::kNotPositive;
    Linearisation next;
    const ProjectionStatus status = problem.linearise(step.trial, next);
    if (damped && !judge_damped(step, next, status, it)) continue;
    if (!damped && status != ProjectionStatus::kOk) return status_of(status);
    it.J_before = it.now.J;
    it.lambda = step.trial;
    it.now = next;
    it.moved = true;
    if (step.length2 < settings.tolerance * settings.tolerance) break;
  }
  const bool stuck = !it.moved && it.last_failure != ProjectionStatus::kOk;
  return stuck ? status_of(it.last_failure) : UpdateStatus::kAccepted;
}

// The new state and covariance, linearised at J; the estimate is as before when they would go bad.
template <class Model>
UpdateStatus commit(const Problem<Model>& problem, const Vector3d& lambda, const Matrix23d& J,
                    FeatureEstimate& estimate) noexcept {
  StateVector& x = estimate.x;
  StateMatrix& P = estimate.P;
  const Eigen::Index d = x.size();
  Cholesky2 factor;
  const Matrix2d innovation_covariance = J * problem.S * J.transpose() + problem.observation.R;
  if (!factor.factor(innovation_covariance)) return UpdateStatus::kNotPositive;
  // U = M J^T L^-T, so that U U^T = M J^T (J S J^T + R)^-1 J M^T.
  Matrix32d K;
  for (int i = 0; i < 3; ++i) K.row(i) = factor.whiten(J.col(i)).transpose();
  CovarianceStep U(d, 2);
  U.noalias() = problem.M * K;
  StateVector x_new(d);
  x_new.noalias() = problem.M * lambda;
  x_new += x;
  if (!x_new.allFinite()) return UpdateStatus::kNotFinite;
  for (Eigen::Index i = 0; i < d; ++i) {
    // Also false for NaN.
    if (!(P(i, i) - U(i, 0) * U(i, 0) - U(i, 1) * U(i, 1) > 0.0)) return UpdateStatus::kNotPositive;
  }
  // The same products in the same order on both sides of the diagonal: symmetric bit by bit.
  for (Eigen::Index j = 0; j < d; ++j) P.col(j) -= U.col(0) * U(j, 0) + U.col(1) * U(j, 1);
  x = x_new;
  return UpdateStatus::kAccepted;
}

}  // namespace

template <class Model>
UpdateOutcome iterated_update(FeatureEstimate& estimate, const Observation& observation, const Model& model,
                              const UpdateSettings& settings) noexcept {
  UpdateOutcome outcome;
  const StateMatrix& P = estimate.P;
  const Basis& b = observation.b;
  const Eigen::Index n = b.size();
  const Eigen::Index d = estimate.x.size();
  const auto refuse = [&outcome](UpdateStatus status) {
    outcome.status = status;
    return outcome;
  };
  if (n == 0 || d != 3 * n || P.rows() != d || P.cols() != d) return refuse(UpdateStatus::kSizeMismatch);
  if (!observation.z.allFinite() || !observation.R.allFinite()) return refuse(UpdateStatus::kNotFinite);
  Problem<Model> problem{observation, model, PositionGain(d, 3), {}, {}, {}};
  if (!problem.R_factor.factor(observation.R)) return refuse(UpdateStatus::kNotPositive);
  for (int axis = 0; axis < 3; ++axis) problem.M.col(axis).noalias() = P.middleCols(axis * n, n) * b;
  Matrix3d& S = problem.S;
  for (int j = 0; j < 3; ++j) {
    for (int i = j; i < 3; ++i) S(i, j) = S(j, i) = problem.M.col(j).segment(i * n, n).dot(b);
  }
  problem.p_hat = position_of(estimate.x, b);

  Iterate it;
  if (const ProjectionStatus status = problem.linearise(it.lambda, it.now); status != ProjectionStatus::kOk) {
    return refuse(status_of(status));
  }
  outcome.innovation = it.now.r;
  Cholesky2 innovation_factor;
  const Matrix2d innovation_covariance = it.now.J * S * it.now.J.transpose() + observation.R;
  if (!innovation_factor.factor(innovation_covariance)) return refuse(UpdateStatus::kNotPositive);
  outcome.normalised_innovation_squared = innovation_factor.whiten(it.now.r).squaredNorm();

  const UpdateStatus ended = iterate(problem, settings, it);
  outcome.iterations = it.count;
  if (ended != UpdateStatus::kAccepted) return refuse(ended);
  outcome.map_cost = it.now.cost;
  if (!(it.now.cost <= settings.gate)) return refuse(UpdateStatus::kRejectedByGate);

  const bool at_final = settings.covariance == CovarianceLinearisation::kFinalIterate;
  const UpdateStatus committed = commit(problem, it.lambda, at_final ? it.now.J : it.J_before, estimate);
  if (committed != UpdateStatus::kAccepted) return refuse(committed);
  outcome.accepted = true;
  outcome.status = UpdateStatus::kAccepted;
  return outcome;
}

template UpdateOutcome iterated_update(FeatureEstimate&, const Observation&, const PixelModel&,
                                       const UpdateSettings&) noexcept;
template UpdateOutcome iterated_update(FeatureEstimate&, const Observation&, const BearingModel&,
                                       const UpdateSettings&) noexcept;

}  // namespace perimap
