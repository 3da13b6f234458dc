// The offset between two clocks by what hand-eye calibration leaves over: errors that go with the speed of the motion.
#pragma once

#include <optional>
#include <vector>

#include "core/calibration/hand_eye_closed_form.hpp"

namespace perimap {

struct MotionOffset {
  double change_s = 0.0;     // to be added to the offset that the pairs were made with
  double deviation_s = 0.0;  // with errors that last, as the errors themselves tell it
  // What it would be if errors were new in each pose and everywhere as large as they are in the mean.
  double white_deviation_s = 0.0;
};

// Least squares over errors (hand_eye_error() of each pair, whitened by their covariance) along the sensor's twist,
// both less their mean over `window_s` around each pose. Errors that last longer than the window, such as those of a
// lens or of a board seen from one side, then weigh nothing, and neither do motions that slow. The deviation is Newey
// and West's (Econometrica 55(3), 1987), and never less than that of white errors. None where fewer than twenty pairs
// are used or nothing moves. `pairs` in the order of their times.
[[nodiscard]] std::optional<MotionOffset> offset_by_motion(const std::vector<PosePair>& pairs,
                                                           const std::vector<Vector6d>& errors,
                                                           const std::vector<char>& used,
                                                           const Eigen::Matrix<double, 6, 6>& error_covariance,
                                                           double window_s);

}  // namespace perimap
