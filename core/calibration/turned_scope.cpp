#include "core/calibration/turned_scope.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

double turn_between(double a, double b) { return std::remainder(a - b, kTwoPi); }

Pose turned_picture(double angle) { return {so3_exp(Vector3d(0.0, 0.0, angle)), Vector3d::Zero()}; }

Pose turn_about(const Vector3d& axis, const Vector3d& point, double angle) {
  const Matrix3d R = so3_exp(angle * axis);
  return {R, point - R * point};
}

// What of a set-up is not the picture's own turn: T(a, q, theta), in S.
Pose carried(const SetupAtRotation& setup, const SetupAtRotation& reference, double turned) {
  return setup.X_SC * turned_picture(turned) * reference.X_SC.inverse();
}

struct Turns {
  Pose carried;
  double angle;
};

// The axis by the rotations, each weighted by how far it turns; then the point that none of them moves.
Expected<void> fit_axis(const std::vector<Turns>& turns, TurnedScope& scope) {
  Vector3d axis = Vector3d::Zero();
  for (const Turns& turn : turns) {
    const Vector3d w = so3_log(turn.carried.R);
    constexpr double kTolerance_rad = 5.0 * kDegree;
    if (std::abs(w.norm() - std::abs(turn.angle)) > kTolerance_rad) {
      return fail("the set-ups do not turn with the scope: " + std::to_string(w.norm() / kDegree) +
                  " degrees of hand-eye for " + std::to_string(std::abs(turn.angle) / kDegree) +
                  " of the notch; measure each with the scope held at its turn, and the sensor fast on the head");
    }
    axis += (turn.angle > 0.0 ? 1.0 : -1.0) * w;
  }
  // A turn of nearly half a turn has either sign: the one that leaves less of all turns.
  const auto left_with = [&](const Vector3d& trial) {
    double left = 0.0;
    for (const Turns& turn : turns) left += so3_log(so3_exp(-turn.angle * trial) * turn.carried.R).squaredNorm();
    return left;
  };
  std::vector<Vector3d> trials{axis.normalized()};
  for (const Turns& turn : turns) {
    const Vector3d w = so3_log(turn.carried.R).normalized();
    trials.insert(trials.end(), {w, Vector3d(-w)});
  }
  scope.axis_S = *std::min_element(trials.begin(), trials.end(),
                                   [&](const Vector3d& a, const Vector3d& b) { return left_with(a) < left_with(b); });
  Matrix3d A = scope.axis_S * scope.axis_S.transpose();  // along the axis: next to the camera
  Vector3d b = scope.axis_S * scope.axis_S.dot(scope.reference.X_SC.t);
  for (const Turns& turn : turns) {
    const Matrix3d M = Matrix3d::Identity() - so3_exp(turn.angle * scope.axis_S);
    A += M.transpose() * M;
    b += M.transpose() * turn.carried.t;
  }
  scope.point_S = A.ldlt().solve(b);
  return {};
}

}  // namespace

SetupAtRotation TurnedScope::at(double rotation_rad) const noexcept {
  const double turned = turn_between(rotation_rad, reference.rotation_rad);
  SetupAtRotation setup;
  setup.rotation_rad = rotation_rad;
  const Pose carry = sensor_on_scope ? Pose{} : turn_about(axis_S, point_S, turned);
  setup.X_SC = carry * reference.X_SC * turned_picture(-turned);
  const Vector2d arm = reference.principal_px - turn_px;
  setup.principal_px = turn_px + Vector2d(std::cos(turned) * arm.x() - std::sin(turned) * arm.y(),
                                          std::sin(turned) * arm.x() + std::cos(turned) * arm.y());
  return setup;
}

Expected<TurnedScope> fit_turned_scope(const std::vector<SetupAtRotation>& setups, const Vector2d& turn_px) {
  constexpr double kLeastTurn_rad = 20.0 * kDegree;
  TurnedScope scope;
  scope.turn_px = turn_px;
  std::vector<Turns> turns;
  double widest = 0.0;
  for (const SetupAtRotation& setup : setups) {
    if (&setup == &setups.front()) {
      scope.reference = setup;
      continue;
    }
    const double angle = turn_between(setup.rotation_rad, scope.reference.rotation_rad);
    turns.push_back({carried(setup, scope.reference, angle), angle});
    widest = std::max(widest, std::abs(angle));
  }
  if (turns.empty() || widest < kLeastTurn_rad) {
    return fail(
        "set-ups at two turns of the scope are needed, 20 degrees apart and more, better three: turn the scope in its "
        "camera head, and measure lens and hand-eye again");
  }
  // A sensor that turns with the scope is not carried about at all.
  scope.sensor_on_scope = std::all_of(turns.begin(), turns.end(), [](const Turns& turn) {
    return so3_log(turn.carried.R).norm() < std::min(3.0 * kDegree, 0.2 * std::abs(turn.angle));
  });
  if (!scope.sensor_on_scope) {
    if (const auto fitted = fit_axis(turns, scope); !fitted) return tl::unexpected(fitted.error());
    // Of half a turn alone the sign of the axis is not told.
    constexpr double kTelling_rad = 150.0 * kDegree;
    if (std::all_of(turns.begin(), turns.end(), [](const Turns& t) { return std::abs(t.angle) > kTelling_rad; })) {
      return fail(
          "set-ups half a turn apart do not tell which way the scope turns: measure one at a quarter of a turn too");
    }
  }
  if (turns.size() < 2) return scope;
  double rotation = 0.0;
  double translation = 0.0;
  for (const SetupAtRotation& setup : setups) {
    const Pose error = scope.at(setup.rotation_rad).X_SC.inverse() * setup.X_SC;
    rotation += std::pow(so3_log(error.R).norm() / kDegree, 2.0) / static_cast<double>(turns.size());
    translation += error.t.squaredNorm() / static_cast<double>(turns.size());
  }
  scope.rotation_rms_deg = std::sqrt(rotation);
  scope.translation_rms_mm = std::sqrt(translation);
  constexpr double kMost_deg = 1.0;
  constexpr double kMost_mm = 2.0;
  if (scope.rotation_rms_deg > kMost_deg || scope.translation_rms_mm > kMost_mm) {
    return fail("the set-ups do not fit one turning scope (" + std::to_string(scope.rotation_rms_deg) +
                " degrees and " + std::to_string(scope.translation_rms_mm) +
                " mm RMS are left over): measure each with the scope held at its turn, and the sensor fast");
  }
  return scope;
}

}  // namespace perimap
