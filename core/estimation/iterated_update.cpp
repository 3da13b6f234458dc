#include "core/estimation/iterated_update.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace perimap {
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

}  // namespace

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

template <class Model>
UpdateOutcome iterated_update(FeatureEstimate& estimate, const Observation& observation, const Model& model,
                              const UpdateSettings& settings) noexcept {
  UpdateOutcome outcome;
  StateVector& x = estimate.x;
  StateMatrix& P = estimate.P;
  const Basis& b = observation.b;
  const Eigen::Index n = b.size();
  const Eigen::Index d = x.size();
  const auto refuse = [&outcome](UpdateStatus status) {
    outcome.status = status;
    return outcome;
  };
  if (n == 0 || d != 3 * n || P.rows() != d || P.cols() != d) return refuse(UpdateStatus::kSizeMismatch);
  if (!observation.z.allFinite() || !observation.R.allFinite()) return refuse(UpdateStatus::kNotFinite);
  Cholesky2 R_factor;
  if (!R_factor.factor(observation.R)) return refuse(UpdateStatus::kNotPositive);

  PositionGain M(d, 3);
  for (int axis = 0; axis < 3; ++axis) M.col(axis).noalias() = P.middleCols(axis * n, n) * b;
  Matrix3d S;
  for (int j = 0; j < 3; ++j) {
    for (int i = j; i < 3; ++i) S(i, j) = S(j, i) = M.col(j).segment(i * n, n).dot(b);
  }
  const Vector3d p_hat = position_of(x, b);

  const auto linearise = [&](const Vector3d& lambda, Linearisation& at) noexcept {
    const Vector3d q = observation.X_CW * (p_hat + S * lambda);
    Vector2d z_predicted;
    Matrix23d dz_dq;
    const ProjectionStatus status = model.predict(q, z_predicted, &dz_dq);
    if (status != ProjectionStatus::kOk) return status;
    at.r = model.residual(observation.z, z_predicted);
    at.J.noalias() = dz_dq * observation.X_CW.R;
    at.cost = lambda.dot(S * lambda) + R_factor.whiten(at.r).squaredNorm();
    return std::isfinite(at.cost) ? ProjectionStatus::kOk : ProjectionStatus::kNotFinite;
  };

  Vector3d lambda = Vector3d::Zero();
  Linearisation now;
  if (const ProjectionStatus status = linearise(lambda, now); status != ProjectionStatus::kOk) {
    return refuse(status_of(status));
  }
  outcome.innovation = now.r;
  {
    Cholesky2 innovation_factor;
    const Matrix2d innovation_covariance = now.J * S * now.J.transpose() + observation.R;
    if (!innovation_factor.factor(innovation_covariance)) return refuse(UpdateStatus::kNotPositive);
    outcome.normalised_innovation_squared = innovation_factor.whiten(now.r).squaredNorm();
  }

  // Levenberg-Marquardt in the metric of the prior, damping mu P^-1. The step D solves (1 + mu) D = J^T v - lambda with
  // R v = r - J S D, hence ((1 + mu) R + J S J^T) v = (1 + mu) r + J S lambda. mu = 0 is Gauss-Newton.
  const bool damped = settings.method == UpdateMethod::kLevenbergMarquardt;
  const double step_factor = damped ? 1.0 : settings.step_factor;
  double mu = 0.0;
  Matrix23d J_covariance = now.J;
  ProjectionStatus last_failure = ProjectionStatus::kOk;
  bool moved = false;
  while (outcome.iterations < settings.max_iterations) {
    ++outcome.iterations;
    const Matrix23d JS = now.J * S;
    const Matrix2d A = (1.0 + mu) * observation.R + JS * now.J.transpose();
    Cholesky2 A_factor;
    if (!A_factor.factor(A)) return refuse(UpdateStatus::kNotPositive);
    const Vector2d v = A_factor.solve((1.0 + mu) * now.r + JS * lambda);
    const Vector3d step = (step_factor / (1.0 + mu)) * (now.J.transpose() * v - lambda);
    const Vector3d trial = lambda + step;
    // Squared length in posterior standard deviations, (P^-1 + H^T R^-1 H) being its inverse.
    const double prior_length2 = step.dot(S * step);
    const double length2 = prior_length2 + R_factor.whiten(JS * step).squaredNorm();
    Linearisation next;
    const ProjectionStatus status = linearise(trial, next);
    if (damped) {
      // Near the minimum rounding decides whether the cost rises or falls; strict descent would stop at sqrt(epsilon).
      const double slack = 1e-9 * (1.0 + now.cost);
      if (status != ProjectionStatus::kOk || !(next.cost <= now.cost + slack)) {
        last_failure = status;
        mu = mu == 0.0 ? 1.0 : 4.0 * mu;
        continue;
      }
      // Where the curvature of h matters, Gauss-Newton overshoots and comes back: keep the damping that prevents it.
      const double expected_fall = length2 + 2.0 * mu * prior_length2;
      if (expected_fall > slack) {
        const double gain = (now.cost - next.cost) / expected_fall;
        if (gain < 0.25) {
          mu = mu == 0.0 ? 0.5 : 2.0 * mu;
        } else if (gain > 0.75) {
          mu = mu > 1e-2 ? 0.25 * mu : 0.0;
        }
      }
    } else if (status != ProjectionStatus::kOk) {
      return refuse(status_of(status));
    }
    J_covariance = now.J;
    lambda = trial;
    now = next;
    moved = true;
    if (length2 < settings.tolerance * settings.tolerance) break;
  }
  if (!moved && last_failure != ProjectionStatus::kOk) return refuse(status_of(last_failure));
  outcome.map_cost = now.cost;
  if (!(now.cost <= settings.gate)) return refuse(UpdateStatus::kRejectedByGate);

  if (settings.covariance == CovarianceLinearisation::kFinalIterate) J_covariance = now.J;
  Cholesky2 final_factor;
  const Matrix2d innovation_covariance = J_covariance * S * J_covariance.transpose() + observation.R;
  if (!final_factor.factor(innovation_covariance)) return refuse(UpdateStatus::kNotPositive);
  // U = M J^T L^-T, so that U U^T = M J^T (J S J^T + R)^-1 J M^T.
  Matrix32d K;
  for (int i = 0; i < 3; ++i) K.row(i) = final_factor.whiten(J_covariance.col(i)).transpose();
  CovarianceStep U(d, 2);
  U.noalias() = M * K;
  StateVector x_new(d);
  x_new.noalias() = M * lambda;
  x_new += x;
  if (!x_new.allFinite()) return refuse(UpdateStatus::kNotFinite);
  for (Eigen::Index i = 0; i < d; ++i) {
    // Also false for NaN.
    if (!(P(i, i) - U(i, 0) * U(i, 0) - U(i, 1) * U(i, 1) > 0.0)) return refuse(UpdateStatus::kNotPositive);
  }
  // The same products in the same order on both sides of the diagonal: symmetric bit by bit.
  for (Eigen::Index j = 0; j < d; ++j) P.col(j) -= U.col(0) * U(j, 0) + U.col(1) * U(j, 1);
  x = x_new;
  outcome.accepted = true;
  outcome.status = UpdateStatus::kAccepted;
  return outcome;
}

template UpdateOutcome iterated_update(FeatureEstimate&, const Observation&, const PixelModel&,
                                       const UpdateSettings&) noexcept;
template UpdateOutcome iterated_update(FeatureEstimate&, const Observation&, const BearingModel&,
                                       const UpdateSettings&) noexcept;

}  // namespace perimap
