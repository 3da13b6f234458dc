// The set-up of an angled scope as a function of how far it is turned in its camera head.
//
// Turning the scope carries its line of sight about the shaft's axis a (through the point q), while the camera's sensor
// stays in the head: the picture turns about its own axis by the same angle. With the tracked sensor S on the head
//   X_SC(theta) = T(a, q, theta) X_SC(0) R_z(-theta)
// (Yamaguchi et al., Computer Aided Surgery 9(5), 2004; Wu & Jaramaz, MICCAI 2008 have the same in other words). A
// scope that looks straight ahead along a does not change. With S on the scope itself T is the identity. The principal
// point goes around the picture's centre of turning.
//
// Zoom and focus make the picture larger and the field stop with it: the stop's radius tells the focal length, by a
// table. The picture then grows about the centre of turning.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "core/calibration/second_sensor.hpp"
#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Between the set-ups that the function is fitted to, at least, degrees: less does not tell the shaft's axis.
inline constexpr double kLeastTurnOfSetups_deg = 20.0;

// One calibration, and how far the scope was turned then, as read_field_stop() or a second sensor tells it.
struct SetupAtRotation {
  double rotation_rad = 0.0;
  Pose X_SC;
  Vector2d principal_px = Vector2d::Zero();
  // The focal length, and the field stop's radius in the picture; zeros where that is not told.
  Vector2d focal_px = Vector2d::Zero();
  double radius_px = 0.0;
  // How well each is known; zeros where that is not told.
  double rotation_deviation_rad = 0.0;
  Matrix6d covariance_C = Matrix6d::Zero();  // of X_SC: rotation (rad), then translation (mm), along C's axes
  Vector2d principal_deviation_px = Vector2d::Zero();
  // Of those errors with the principal point's: a hand-eye is measured through a lens, and turned by what that is off.
  Eigen::Matrix<double, 6, 2> covariance_with_principal = Eigen::Matrix<double, 6, 2>::Zero();
};

// A focal length, by the field stop's radius in the picture.
struct FocalAtRadius {
  double radius_px = 0.0;
  Vector2d focal_px = Vector2d::Zero();
};

struct LensAtTurn {
  Vector2d focal_px = Vector2d::Zero();
  Vector2d principal_px = Vector2d::Zero();
};

struct TurnedScope {
  // Radii that differ by no more than this share of them are of one zoom.
  static constexpr double kSameZoom = 0.015;

  SetupAtRotation reference;
  bool sensor_on_scope = false;
  Vector3d axis_S = Vector3d::UnitZ();  // of the shaft, in S; where the sensor is on the head
  Vector3d point_S = Vector3d::Zero();  // on that axis, next to the camera, mm
  Vector2d turn_px = Vector2d::Zero();  // about which the principal point goes
  int width = 0;                        // px, of the pictures; 0: not told
  int height = 0;
  std::vector<FocalAtRadius> focals;          // of rising radius; empty: zoom and focus are not told of
  std::optional<SecondSensor> second_sensor;  // tells the rotation; none: the field stop does
  // What is left of the set-ups that it was made from; 0 with two.
  double rotation_rms_deg = 0.0;
  double translation_rms_mm = 0.0;
  // Each of three set-ups and more held against the function that the others alone make; 0: not tried.
  double aside_rotation_rms_deg = 0.0;
  double aside_translation_rms_mm = 0.0;
  // Standard deviations by those of the set-ups: of the axis, of its point across it, and of the whole set-up at the
  // turn where it is known worst (3-D norms; px per axis, the larger).
  double axis_deviation_rad = 0.0;
  double point_deviation_mm = 0.0;
  double rotation_deviation_rad = 0.0;
  double translation_deviation_mm = 0.0;
  double principal_deviation_px = 0.0;
  // Likewise of a target so far ahead in the picture's middle, by hand-eye and principal point together, of which each
  // makes good most of what the other is off for the lens; 0: the focal length is not told.
  static constexpr double kTargetAhead_mm = 90.0;
  double target_deviation_mm = 0.0;

  // At the zoom of the reference.
  [[nodiscard]] SetupAtRotation at(double rotation_rad) const noexcept;
  // As the scope is turned and zoomed, by the field stop's radius; none at a zoom beyond those of the table.
  [[nodiscard]] std::optional<LensAtTurn> lens_at(double rotation_rad, double radius_px) const noexcept;
};

// Whether a field stop of these radii is of one zoom, as far as they tell.
[[nodiscard]] bool is_same_zoom(double a_px, double b_px) noexcept;

// A table of what was measured at several zooms, for TurnedScope::focals: of one zoom the mean.
[[nodiscard]] std::vector<FocalAtRadius> focal_table(std::vector<FocalAtRadius> measured);

// From calibrations at two turns and more, 20 degrees apart and more, at one zoom. `turn_px`: of the field stop; none:
// of three set-ups and more, the point about which their principal points go. Fails, and says what is missing, when
// they are too near to each other, do not turn as a scope does, or are of several zooms.
[[nodiscard]] Expected<TurnedScope> fit_turned_scope(const std::vector<SetupAtRotation>& setups,
                                                     const std::optional<Vector2d>& turn_px);

}  // namespace perimap
