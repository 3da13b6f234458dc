// By how much the set-up is off: the ten numbers that a session's own matches can tell, and the set-up that they make.
//
//   X_WC  <-  X_WC(t + tau) D,   D = (exp([theta]x), d)   hand-eye: the camera turned and moved in its own frame
//   f     <-  (1 + phi) f        both focal lengths
//   c     <-  c + delta_c        the principal point
//
// A number is what has to be added to the configured set-up to come to the true one. The tracker's scale is not among
// them: it can hardly be told from the hand-eye along the axis, and needs something of known length.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/geometry/camera_model.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

inline constexpr int kSetupNumbers = 10;
using SetupVector = Eigen::Matrix<double, kSetupNumbers, 1>;
using SetupMatrix = Eigen::Matrix<double, kSetupNumbers, kSetupNumbers>;

// Where each stands in a SetupVector.
inline constexpr int kTurnAt = 0;            // theta, rad, frame C: about its x, y, z
inline constexpr int kMoveAt = 3;            // d, mm, frame C
inline constexpr int kFocalAt = 6;           // phi, a fraction
inline constexpr int kPrincipalPointAt = 7;  // delta_c, px
inline constexpr int kTimeAt = 9;            // tau, s: the camera was where the tracker says that it was tau later

// The numbers that one mistake puts off together.
enum class SetupPart : std::uint8_t {
  kHandEyeTurn,
  kHandEyeAcross,  // the optical axis
  kHandEyeAlong,
  kFocalLength,
  kPrincipalPoint,
  kTimeOffset
};
inline constexpr std::array kSetupParts = {SetupPart::kHandEyeTurn,    SetupPart::kHandEyeAcross,
                                           SetupPart::kHandEyeAlong,   SetupPart::kFocalLength,
                                           SetupPart::kPrincipalPoint, SetupPart::kTimeOffset};

struct SetupRange {
  int begin = 0;
  int size = 0;
};
[[nodiscard]] constexpr SetupRange range_of(SetupPart part) noexcept {
  switch (part) {
    case SetupPart::kHandEyeTurn:
      return {kTurnAt, 3};
    case SetupPart::kHandEyeAcross:
      return {kMoveAt, 2};
    case SetupPart::kHandEyeAlong:
      return {kMoveAt + 2, 1};
    case SetupPart::kFocalLength:
      return {kFocalAt, 1};
    case SetupPart::kPrincipalPoint:
      return {kPrincipalPointAt, 2};
    case SetupPart::kTimeOffset:
      return {kTimeAt, 1};
  }
  return {};
}

// How far a set-up may be off that was measured once: the prior's standard deviations, wide. They keep numbers at zero
// of which a window tells nothing.
[[nodiscard]] inline SetupVector widest_setup_deviations() noexcept {
  SetupVector deviations;
  deviations << 0.1, 0.1, 0.1, 20.0, 20.0, 20.0, 0.1, 30.0, 30.0, 0.05;
  return deviations;
}

// How fast the camera moves, in its own frame.
struct CameraTwist {
  Vector3d turn_C_rad_per_s = Vector3d::Zero();
  Vector3d move_C_mm_per_s = Vector3d::Zero();  // of its centre
};

// The pose that the corrected set-up has.
[[nodiscard]] inline Pose corrected(const Pose& X_WC, const CameraTwist& twist, const SetupVector& deviation) noexcept {
  const double tau = deviation(kTimeAt);
  const Pose moved{so3_exp(tau * twist.turn_C_rad_per_s), tau * twist.move_C_mm_per_s};
  const Pose D{so3_exp(deviation.segment<3>(kTurnAt)), deviation.segment<3>(kMoveAt)};
  return X_WC * moved * D;
}

[[nodiscard]] inline CameraModel corrected(CameraModel camera, const SetupVector& deviation) noexcept {
  camera.fx *= 1.0 + deviation(kFocalAt);
  camera.fy *= 1.0 + deviation(kFocalAt);
  camera.cx += deviation(kPrincipalPointAt);
  camera.cy += deviation(kPrincipalPointAt + 1);
  return camera;
}

}  // namespace perimap
