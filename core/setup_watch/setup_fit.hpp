// The set-up that explains a window of matches best, whatever the features' motions are.
//
// Unknown together: the ten numbers of the set-up's deviation, each feature's coefficients (their prior is wide: what
// the map has of them is only where the estimate begins, for a map that was learnt under a wrong set-up hides it), and
// each frame's error of pose and phase with the tracker's and the clock's deviations as their prior. Gauss-Newton with
// the frames' unknowns eliminated first (frame_equations.hpp) and the features' next, by Schur complements: what
// remains is ten equations, S ddelta = b.
//
// S is the information where all errors are new in each frame. They need not be: a tracker that errs for seconds, and
// matches of one feature that err alike. The estimate is linear in the residuals, with the influence E_f^T W_f r_f of
// frame f, so its covariance under errors of another kind follows (least squares under another noise than assumed:
// White, Econometrica 48, 1980):
//
//   - under errors of the tracker that last, by the correlation that was told, or that the frames' own errors show
//   where
//     that is longer; exactly
//   - under whatever else makes residuals alike for some seconds, by the influences themselves (Newey & West,
//     Econometrica 55, 1987), of which the mean over the ten directions is taken, where it is above what was told.
//
// Not for the real-time path: it allocates, and takes a tenth of a second.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/estimation/feature_estimate.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/periodic/basis.hpp"
#include "core/setup_watch/setup_deviation.hpp"
#include "core/setup_watch/watched_window.hpp"

namespace perimap {

struct SetupFitSettings {
  Prior motion;  // of the features' coefficients: harmonics about zero, the mean about where the map has it
  SetupVector deviations = widest_setup_deviations();  // the prior's of the set-up, about zero
  double gate = 23.0;                                  // chi-squared, 2 degrees of freedom, 99.999 %
  int robust_iterations = 2;                           // with the weights of Student's t
  int most_iterations = 6;                             // all together, at least one more than the robust ones
  double tolerance = 0.1;                              // ends them: the step, in the estimate's own deviations
  double largest_chi2 = 3.0;                           // of a freedom; above, nothing of this kind explains the window
  double least_spread_mm = 3.0;  // of the camera's centre, root mean square beyond the tracker's noise
  double alike_s = 2.0;          // errors that are farther apart than this are unlike
};

enum class SetupFitState : std::uint8_t {
  kTooLittle,  // too few frames or features
  kStill,      // the camera has hardly moved: from one place no set-up is told from another
  kUnsolved,   // no motions and no set-up explain the window, or none was found
  kSolved
};

struct SetupFit {
  SetupFitState state = SetupFitState::kTooLittle;  // but for kSolved the rest means nothing
  SetupVector deviation = SetupVector::Zero();
  SetupMatrix covariance = SetupMatrix::Zero();
  // By how much more the estimate scatters than the errors that were told explain, as a factor of the variance; at
  // least 1, and within `covariance`.
  double scatter = 1.0;
  double error_correlation_s = 0.0;  // of the tracker's error, as told, or as seen where that is longer
  // What the residuals weigh with this set-up, and with the configured one and the motions that suit it best; both are
  // of squared deviations, and `freedom` is what the first should be about.
  double chi2_with = 0.0;
  double chi2_without = 0.0;
  double freedom = 0.0;
  int frames = 0;
  int matches = 0;
  // d p_WF / d deviation of each feature's mean position: where it would be with the corrected set-up, per number.
  std::vector<Eigen::Matrix<double, 3, kSetupNumbers>> shift;
};

[[nodiscard]] SetupFit fit_setup(const WatchedWindow& window, const CameraModel& camera, const BasisLayout& layout,
                                 const SetupFitSettings& settings = {});

}  // namespace perimap
