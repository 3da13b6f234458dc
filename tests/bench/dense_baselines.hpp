// What the bank is compared with: the update in the state's full dimension, as published and as a Kalman filter.
#pragma once

#include <vector>

#include "core/estimation/feature_estimate.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/estimation/observation.hpp"

namespace perimap::bench {

// Tully, Kantor & Choset (2013): Gauss-Newton on (x - x^)^T P^-1 (x - x^) + r^T R^-1 r, each step by Cholesky
// factorisation of P^-1 + H^T R^-1 H; the covariance is its inverse.
void paper_update(FeatureEstimate& estimate, const Observation& observation, const PixelModel& model, int iterations);

// The iterated extended Kalman filter with H of 2 x d: K = P H^T (H P H^T + R)^-1, P <- P - K (P H^T)^T.
void kalman_update(FeatureEstimate& estimate, const Observation& observation, const PixelModel& model, int iterations);

// The batch alternative: solves all observations anew from x (by Ceres), prior included. Returns the iterations.
int window_solution(StateVector& x, const FeatureEstimate& prior, const std::vector<Observation>& observations,
                    const PixelModel& model);

}  // namespace perimap::bench
