// How an update iterates, and when it is refused.
#pragma once

#include <cstdint>

namespace perimap {

enum class UpdateMethod : std::uint8_t {
  kLevenbergMarquardt,  // cost never rises (beyond rounding)
  kGaussNewton,         // the paper's: every step taken, shortened by step_factor
};

// Where the Jacobian of the covariance update is taken.
enum class CovarianceLinearisation : std::uint8_t {
  kFinalIterate,
  kLastStep,  // the point the last step started from; with one iteration this is the extended Kalman filter
};

struct UpdateSettings {
  UpdateMethod method = UpdateMethod::kLevenbergMarquardt;
  int max_iterations = 5;    // steps tried; at least 1
  double step_factor = 1.0;  // the paper's gamma, for Gauss-Newton; 0 < gamma <= 1
  // Ends the iterations: length of the last step in standard deviations of the posterior. 0 never ends them early. What
  // is then still missing is far smaller, since the steps shrink fast.
  double tolerance = 1e-2;
  // An update with J above this at its end is refused: chi-squared with 2 degrees of freedom, 99.999 %. A narrower one
  // costs accuracy: at 99.9 % one good observation of each 1000 is lost, and one feature of 100 was 6 % further off
  // than with all of them, measured when the gate was chosen (docs/decisions/0019-a-batch-starts-a-feature.md).
  double gate = 23.0;
  CovarianceLinearisation covariance = CovarianceLinearisation::kFinalIterate;
};

}  // namespace perimap
