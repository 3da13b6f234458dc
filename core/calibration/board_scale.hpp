// Whether the lengths of a board are those of the tracker: squares that are printed smaller than is said, or a table in
// another unit, make a hand-eye that is wrong along the line of sight and fits nearly as well.
#pragma once

#include <vector>

#include "core/calibration/hand_eye_closed_form.hpp"

namespace perimap {

struct BoardScale {
  double ratio = 1.0;  // of the board's lengths by the tracker to those that were said
  double deviation = 0.0;
  // Of X_SC = estimate * exp(change), were that ratio true: rotation, rad, then translation, mm.
  Vector6d change_C = Vector6d::Zero();
};

// By one step of least squares from a hand-eye that fits best with the lengths as they were said; errors weighted by
// `error_covariance` (rotation, translation, in S) and supposed to last `correlation_length` poses. `with_offset`: the
// clocks' offset is open as well. Where the motion does not tell the ratio it is 1, with a deviation of infinity.
[[nodiscard]] BoardScale board_scale(const std::vector<PosePair>& pairs, const std::vector<char>& used,
                                     const Pose& X_SC, const Pose& X_WB,
                                     const Eigen::Matrix<double, 6, 6>& error_covariance, double correlation_length,
                                     bool with_offset);

}  // namespace perimap
