// Hand-eye, board and time offset together: the least squares over all poses of a camera that sees a board and of the
// sensor that it is mounted on. By Ceres, whose headers stay in the source file.
#pragma once

#include <vector>

#include "core/calibration/hand_eye_closed_form.hpp"

namespace perimap {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

struct HandEyeAdjustment {
  Pose X_SC;
  Pose X_WB;
  double offset_change_s = 0.0;  // to be added to the offset that the pairs were made with
  // Of (rotation about C's axes, rad; translation along them, mm; time offset, s): X_SC = estimate * exp(error).
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
  // Of one pose's error, as hand_eye_error() has it: both devices' noise as it is seen at the sensor.
  Matrix6d error_covariance = Matrix6d::Identity();
  bool converged = false;
};

// Over the pairs that are `used`, errors weighted by `error_covariance`, from this start. With estimate_offset the
// poses are shifted along their twists. The covariance supposes independent errors.
[[nodiscard]] HandEyeAdjustment adjust_hand_eye(const std::vector<PosePair>& pairs, const std::vector<char>& used,
                                                const Pose& X_SC, const Pose& X_WB, const Matrix6d& error_covariance,
                                                bool estimate_offset);

}  // namespace perimap
