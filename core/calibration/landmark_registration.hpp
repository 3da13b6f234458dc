// The place of one frame in another by points known in both (Umeyama, PAMI 13(4), 1991, without scale), and how well a
// target elsewhere is then known (Fitzpatrick, West & Maurer, IEEE Trans. Medical Imaging 17(5), 1998).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

struct Landmark {
  std::string name;
  Vector3d p_I = Vector3d::Zero();  // in the image's frame I, mm
  Vector3d p_W = Vector3d::Zero();  // as touched, in the frame W, mm
};

struct LandmarkRegistration {
  Pose X_IW;
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  // (rotation, translation) in I about
                                                                                 // the landmarks' middle, rad and mm
  Vector3d middle_I = Vector3d::Zero();
  double fre_mm = 0.0;                // RMS distance that remains
  double fle_mm = 0.0;                // RMS error of one landmark that it tells; 0 with fewer than four
  std::vector<double> residuals_mm;   // of each landmark
  std::vector<double> held_aside_mm;  // of each about what the others tell; empty with fewer than four
};

// Fails with fewer than three landmarks, with landmarks on a line, and when one landmark alone is off by more than
// `tolerance_mm` from where all others have it: another point was touched. It then names it.
[[nodiscard]] Expected<LandmarkRegistration> register_landmarks(const std::vector<Landmark>& landmarks,
                                                                double tolerance_mm);

// Expected RMS error of a target, mm, by the landmarks' error (a registration's own fle_mm, or one known beforehand).
[[nodiscard]] double expected_target_error_mm(const std::vector<Landmark>& landmarks, const Vector3d& target_I,
                                              double fle_mm);

// Rotation and translation that take the points `from` to `to` with the least squares.
[[nodiscard]] Pose rigid_fit(const std::vector<Vector3d>& to, const std::vector<Vector3d>& from);

}  // namespace perimap
