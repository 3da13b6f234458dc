// Where the camera sits in the tracked sensor, from the poses of both: `perimap calibrate hand-eye`.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/board_scale.hpp"
#include "core/calibration/timed_poses.hpp"
#include "core/error/expected.hpp"
#include "daemon/setup/hand_eye_adjustment.hpp"

namespace perimap {

struct HandEyeSettings {
  double largest_offset_s = 1.5;  // between the two clocks
  // A result that is less certain than this in any direction is refused.
  double largest_translation_deviation_mm = 5.0;
  double largest_rotation_deviation_deg = 2.0;
  // A board whose lengths are off by more than this by the tracker, and by more than five deviations, is refused.
  double largest_scale_error = 0.04;
};

// What another solver makes of the same pairs.
struct OtherHandEye {
  std::string method;
  Pose X_SC;
  double residual_median_mm = 0.0;
};

struct HandEyeCalibration {
  Pose X_SC;
  Pose X_WB;
  Eigen::Matrix<double, 7, 7>
      covariance;  // as HandEyeAdjustment has it, for errors that last `correlation_length` poses
  // What of it the lens's own uncertainty makes; none: the lens was taken for exact, because its calibration says
  // nothing of that, or because of `lens_untold`.
  std::optional<Eigen::Matrix<double, 7, 7>> covariance_by_lens;
  // Of the hand-eye's rotation and place with the lens's principal point, px; zero where the lens was taken for exact.
  Eigen::Matrix<double, 6, 2> covariance_with_principal = Eigen::Matrix<double, 6, 2>::Zero();
  std::string lens_untold = "how well it is known was not told";
  Matrix6d error_covariance;  // of one pose, at the sensor
  // Of the camera's lengths beside the tracker's. What it is off beyond three deviations is in `covariance`.
  BoardScale scale;
  double correlation_length = 1.0;
  bool offset_measured = false;  // false: there is no motion with times of its own to measure it by
  double offset_s = 0.0;         // added to the tracker's times to get the camera's
  double joint_offset_s = 0.0;   // what the adjustment together with the places would have it, all errors being noise
  // brisk_speed() of the pairs: what tells time from errors that last.
  double brisk_rad_per_s = 0.0;
  bool paired_by_rows = false;     // the times of the two files say nothing of which pose belongs to which
  double speed_correlation = 0.0;  // of the angular speeds, at
  double speed_offset_s = 0.0;     // the offset that they alone tell
  std::vector<PosePair> pairs;
  std::vector<char> used;                  // of each pair
  std::size_t without_tracker_pose = 0;    // camera poses that fall into the tracker's gaps
  Vector3d spread_deg = Vector3d::Zero();  // of the orientations about their principal axes, largest first
  std::vector<double> disagreements_mm;    // translation of AX - XB over all pairs of poses 1 s apart, none left out
  double disagreement_interval_s = 1.0;    // 1, or what lies between poses where none are 1 s apart
  double residual_median_mm = 0.0;         // their median
  double residual_median_mm_deviation = 0.0;
  double fitted_rms_mm = 0.0;      // the camera's place in the board's frame, of the poses used
  double held_aside_rms_mm = 0.0;  // each fifth of the time about what the others tell
  double held_aside_rms_deg = 0.0;
  std::vector<OtherHandEye> others;

  // Where a heart is: what the errors of rotation and place together make of it.
  static constexpr double kTargetAhead_mm = 90.0;
  // Standard deviation of a target there as a 3-D norm: 95 % of such targets are within a millimetre and less then.
  static constexpr double kWellKnownTarget_mm = 0.4;
  [[nodiscard]] double target_deviation_mm() const;
  // Of a target there by the lens's uncertainty: what the picture and the hand-eye that go with another lens make of it
  // together, which is less than either.
  double target_deviation_by_lens_mm = 0.0;

  // Whether something moved fast enough for the offset's deviation to be trusted; the errors of a lens, or of a board
  // seen from one side, last, and without fast motion they pass for time.
  static constexpr double kLeastBrisk_rad_per_s = 0.2;
  [[nodiscard]] bool is_brisk() const { return brisk_rad_per_s >= kLeastBrisk_rad_per_s; }
};

// X_WS of the tracker and X_BC of the camera, each with times of its own clock, in any order. Fails, and says what is
// missing, when they never overlap or do not move alike, when there are too few, when their motion does not determine
// the result, or when their lengths are of two scales.
[[nodiscard]] Expected<HandEyeCalibration> calibrate_hand_eye(std::vector<TimedPose> camera,
                                                              std::vector<TimedPose> tracker,
                                                              const HandEyeSettings& settings);

}  // namespace perimap
