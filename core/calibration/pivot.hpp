// Where a tracked tool's tip is: turned about its resting tip, every pose puts the tip at one point.
#pragma once

#include <cstddef>
#include <vector>

#include "core/calibration/timed_poses.hpp"
#include "core/error/expected.hpp"

namespace perimap {

struct PivotCalibration {
  Vector3d tip_T = Vector3d::Zero();         // in the tool's frame T, mm
  Matrix3d covariance_T = Matrix3d::Zero();  // mm^2
  Vector3d pivot_W = Vector3d::Zero();       // where it rested, mm
  double rms_all_mm = 0.0;                   // least squares over all poses, none left out: what other programs print
  double rms_mm = 0.0;                       // of the poses used
  double worst_mm = 0.0;                     // of the poses used
  double held_aside_mm = 0.0;                // RMS of each fifth of the poses about what the others tell
  double correlation_length = 1.0;           // poses in a row that count as one
  Vector3d spread_deg = Vector3d::Zero();    // of the orientations about their principal axes, largest first
  std::vector<char> used;                    // of each pose
};

// R_i tip + t_i = pivot over poses X_WT in the order of their times, by least squares over the samples that a search
// for the least median of squared distances calls good (Rousseeuw 1984), weighted by the errors' covariance in the
// tool's frame. Fails, and says what is missing, with fewer than ten poses, with a motion about one axis, when fewer
// than half of the poses agree on a point, when those that do lie more than 5 mm RMS about it, or when it is more than
// a metre away.
[[nodiscard]] Expected<PivotCalibration> calibrate_pivot(const std::vector<TimedPose>& poses);

}  // namespace perimap
