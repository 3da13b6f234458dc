#include "core/estimation/batch_start.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/estimation/batch_problem.hpp"
#include "core/estimation/feature_prior.hpp"
#include "core/estimation/prior_start.hpp"
#include "core/estimation/student_t_loss.hpp"

namespace perimap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Mean of the Student-t loss beside that of residuals which are as large as they are said to be: (nu + 2) e^a E_1(a)
// with a = nu / 2. Some gross outliers do not add much to it.
double misfit_of(std::span<const double> residual2) {
  constexpr double kExpected = 2.2417;
  double sum = 0.0;
  for (const double s : residual2) sum += student_t_loss(s);
  return sum / (kExpected * static_cast<double>(residual2.size()));
}

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

// State and covariance at the solution, out of the whitened coordinates. False when they are no numbers. Tells
// PriorStart::prior_misfit.
template <class Model>
bool estimate_at(BatchProblem<Model>& problem, const VectorXd& y, BatchOutcome& outcome, double& prior_misfit) {
  const Index d = problem.dimension();
  MatrixXd A;
  VectorXd descent;
  outcome.map_cost = problem.evaluate(y, Loss::kQuadratic);
  problem.normal_equations(y, A, descent);
  const Eigen::LLT<MatrixXd> factor(A);
  if (factor.info() != Eigen::Success) return false;
  const MatrixXd P = factor.solve(MatrixXd::Identity(d, d));
  // y^ = (I - P) (what the observations say of y), whose expected square is the trace of I - P where the prior is true.
  prior_misfit = y.squaredNorm() / std::max(static_cast<double>(d) - P.trace(), 1e-9);
  outcome.estimate.x = problem.state_at(y);
  outcome.estimate.P = problem.covariance_of_state(P);
  return outcome.estimate.x.allFinite() && outcome.estimate.P.allFinite();
}

template <class Model>
BatchStatus check(std::span<const Observation> observations, const Model& model, int n, const BatchSettings& settings) {
  if (observations.empty() || static_cast<int>(observations.size()) < settings.min_observations) {
    return BatchStatus::kTooFewObservations;
  }
  const bool all_usable = std::all_of(observations.begin(), observations.end(),
                                      [&](const Observation& observation) { return usable(observation, model, n); });
  return all_usable ? BatchStatus::kOk : BatchStatus::kBadObservation;
}

// From a robust solution to what the recursion goes on from. Returns PriorStart::prior_misfit.
template <class Model>
double finish(BatchProblem<Model>& problem, Solution& solution, const BatchSettings& settings, BatchOutcome& outcome) {
  double prior_misfit = 0.0;
  outcome.status = refine(problem, settings, solution, outcome);
  if (!outcome.ok()) return prior_misfit;
  if (!estimate_at(problem, solution.y, outcome, prior_misfit)) {
    outcome.status = BatchStatus::kDiverged;
    return prior_misfit;
  }
  outcome.inlier = problem.used();
  outcome.inliers = count_inliers(problem);
  outcome.R = problem.R();
  return prior_misfit;
}

}  // namespace

template <class Model>
BatchOutcome batch_start(std::span<const Observation> observations, const Model& model, const BasisLayout& layout,
                         const Prior& prior, const BatchSettings& settings) {
  BatchOutcome outcome;
  outcome.status = check(observations, model, layout.size(), settings);
  if (!outcome.ok()) return outcome;
  Vector3d ray_C;
  if (!model.ray(observations.front().z, ray_C)) {
    outcome.status = BatchStatus::kBadObservation;
    return outcome;
  }
  const Pose X_WC = observations.front().X_CW.inverse();
  const Vector3d prior_mean = X_WC * (settings.prior_depth_mm * ray_C);
  const FeaturePrior wide = wide_prior(layout, prior, prior_mean);
  BatchProblem<Model> problem(observations, model, wide, settings.huber_deviations);

  const auto offset_of = [&](double depth_mm) { return Vector3d(X_WC * (depth_mm * ray_C) - prior_mean); };
  Solution solution;
  outcome.status =
      best_of_starts(problem, offset_of, prior.dc_mm, layout.size(), settings, outcome.iterations, solution);
  if (outcome.ok()) static_cast<void>(finish(problem, solution, settings, outcome));
  return outcome;
}

template <class Model>
PriorStart start_from_prior(std::span<const Observation> observations, const Model& model, const FeaturePrior& prior,
                            const BatchSettings& settings) {
  PriorStart start;
  BatchOutcome& outcome = start.outcome;
  outcome.status = check(observations, model, static_cast<int>(prior.x.size() / 3), settings);
  if (!outcome.ok()) return start;
  BatchProblem<Model> problem(observations, model, prior, settings.huber_deviations);
  std::vector<Solution> rough_solutions;
  std::optional<Solution> solution =
      descend(problem, VectorXd::Zero(problem.dimension()), settings, rough_solutions, outcome.iterations);
  if (!solution || !solution->converged) {
    outcome.status = problem.visible() == 0 ? BatchStatus::kBehindCamera : BatchStatus::kDiverged;
    return start;
  }
  start.prior_misfit = finish(problem, *solution, settings, outcome);
  return start;
}

template BatchOutcome batch_start(std::span<const Observation>, const PixelModel&, const BasisLayout&, const Prior&,
                                  const BatchSettings&);
template BatchOutcome batch_start(std::span<const Observation>, const BearingModel&, const BasisLayout&, const Prior&,
                                  const BatchSettings&);
template PriorStart start_from_prior(std::span<const Observation>, const PixelModel&, const FeaturePrior&,
                                     const BatchSettings&);
template PriorStart start_from_prior(std::span<const Observation>, const BearingModel&, const FeaturePrior&,
                                     const BatchSettings&);

}  // namespace perimap
