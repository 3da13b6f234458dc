// The delayed start of a feature: one batch MAP estimate from all its buffered observations.
//
// The paper starts its filter on the first ray alone. Early on the cost then has two minima, and iterating invents
// depth; a batch over two seconds or so of motion, solved from several start depths, does not suffer from it. The loss
// is Huber's first (wide basin), then Student's t with 3 degrees of freedom (rejects gross outliers; where it finds
// any, once more by way of enlarged covariances, and the lower cost counts), then the plain quadratic on what lies
// within the gate, which is what the recursion goes on from. There each observation is as uncertain as the phase makes
// it, by the motion that the robust solution found.
//
// Not for the real-time path: it allocates. Deterministic.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/estimation/batch_status.hpp"
#include "core/estimation/feature_estimate.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/estimation/observation.hpp"

namespace perimap {

struct BatchSettings {
  std::vector<double> start_depths_mm = {50.0, 90.0, 160.0};  // along the first observation's ray
  double prior_depth_mm = 90.0;   // the prior's mean lies there on the same ray, whatever the start
  bool robust = true;             // false: the plain MAP estimate of all observations
  double huber_deviations = 2.0;  // Mahalanobis radius where Huber's loss turns linear
  double gate = 23.0;             // chi-squared, 2 degrees of freedom, 99.999 %: what is beyond is an outlier
  double min_inlier_fraction = 0.5;
  int min_observations = 10;
  int max_iterations = 60;  // of Levenberg-Marquardt, for each loss
  // Ends the last solution: squared length of the step in standard deviations of the posterior.
  double tolerance = 1e-8;
};

inline constexpr double kContradictedMisfit = 2.0;

struct BatchOutcome {
  BatchStatus status = BatchStatus::kDiverged;
  FeatureEstimate estimate;     // valid when status is kOk
  double map_cost = 0.0;        // prior + inliers, as in iterated_update
  double robust_cost = 0.0;     // with the Student-t loss, where kTooManyOutliers too; map_cost when not robust
  double misfit = 0.0;          // of a robust start: the mean loss of its residuals beside what is expected, about 1
  std::vector<double> weights;  // per observation: the Student-t weight at its solution, about 1 for a good one
  std::vector<std::uint8_t> inlier;  // per observation: 1 when used in the estimate
  std::vector<Matrix2d> R;           // per observation: what it counted with there, the phase's deviation included
  int inliers = 0;
  int iterations = 0;  // over all starts and losses

  [[nodiscard]] bool ok() const noexcept { return status == BatchStatus::kOk; }
  // No motion of this kind explains the observations: their phases are wrong, or the tissue moves by more than the
  // heart.
  [[nodiscard]] bool contradicted() const noexcept { return misfit > kContradictedMisfit; }
};

template <class Model>
[[nodiscard]] BatchOutcome batch_start(std::span<const Observation> observations, const Model& model,
                                       const BasisLayout& layout, const Prior& prior,
                                       const BatchSettings& settings = {});

extern template BatchOutcome batch_start(std::span<const Observation>, const PixelModel&, const BasisLayout&,
                                         const Prior&, const BatchSettings&);
extern template BatchOutcome batch_start(std::span<const Observation>, const BearingModel&, const BasisLayout&,
                                         const Prior&, const BatchSettings&);

}  // namespace perimap
