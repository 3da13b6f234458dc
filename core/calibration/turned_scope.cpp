#include "core/calibration/turned_scope.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

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
                  " of the scope; measure each with the scope held at its turn, and the sensor fast on the head");
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

std::optional<LensAtTurn> TurnedScope::lens_at(double rotation_rad, double radius_px) const noexcept {
  const SetupAtRotation setup = at(rotation_rad);
  if (focals.empty()) return LensAtTurn{reference.focal_px, setup.principal_px};
  // Written so that what is no number is none.
  if (!(radius_px >= focals.front().radius_px * (1.0 - kSameZoom)) ||
      !(radius_px <= focals.back().radius_px * (1.0 + kSameZoom))) {
    return std::nullopt;
  }
  Vector2d focal = focals.front().focal_px;
  for (std::size_t i = 1; i < focals.size(); ++i) {
    const FocalAtRadius& a = focals[i - 1];
    const FocalAtRadius& b = focals[i];
    if (radius_px < a.radius_px) break;
    const double share = std::min(1.0, (radius_px - a.radius_px) / (b.radius_px - a.radius_px));
    focal = a.focal_px + share * (b.focal_px - a.focal_px);
  }
  const Vector2d grown = focal.cwiseQuotient(reference.focal_px);
  return LensAtTurn{focal, turn_px + grown.cwiseProduct(setup.principal_px - turn_px)};
}

bool is_same_zoom(double a_px, double b_px) noexcept {
  return std::max(a_px, b_px) <= std::min(a_px, b_px) * (1.0 + TurnedScope::kSameZoom);
}

std::vector<FocalAtRadius> focal_table(std::vector<FocalAtRadius> measured) {
  std::sort(measured.begin(), measured.end(),
            [](const FocalAtRadius& a, const FocalAtRadius& b) { return a.radius_px < b.radius_px; });
  std::vector<FocalAtRadius> table;
  std::size_t in_last = 0;
  double first_of_last_px = 0.0;
  for (const FocalAtRadius& one : measured) {
    if (!table.empty() && one.radius_px <= first_of_last_px * (1.0 + TurnedScope::kSameZoom)) {
      const double share = 1.0 / static_cast<double>(++in_last);
      FocalAtRadius& mean = table.back();
      mean.radius_px += share * (one.radius_px - mean.radius_px);
      mean.focal_px += share * (one.focal_px - mean.focal_px);
    } else {
      table.push_back(one);
      in_last = 1;
      first_of_last_px = one.radius_px;
    }
  }
  return table;
}

namespace {

// One zoom, if it is told of at all.
Expected<void> check_zooms(const std::vector<SetupAtRotation>& setups) {
  const auto [least, most] =
      std::minmax_element(setups.begin(), setups.end(),
                          [](const SetupAtRotation& a, const SetupAtRotation& b) { return a.radius_px < b.radius_px; });
  if (is_same_zoom(least->radius_px, most->radius_px)) return {};
  return fail("the set-ups are of several zooms (the field stop's radius is " + std::to_string(least->radius_px) +
              " to " + std::to_string(most->radius_px) +
              " px): turn the scope at one zoom, and tell of other zooms by --zoom");
}

// The principal point at the reference by all set-ups, each turned back to it.
Vector2d reference_principal(const std::vector<SetupAtRotation>& setups, const TurnedScope& scope) {
  Vector2d arm = Vector2d::Zero();
  for (const SetupAtRotation& setup : setups) {
    const Eigen::Rotation2Dd back(-turn_between(setup.rotation_rad, scope.reference.rotation_rad));
    arm += back * (setup.principal_px - scope.turn_px) / static_cast<double>(setups.size());
  }
  return scope.turn_px + arm;
}

// About which the principal points go: each is the centre plus one arm, turned; by least squares.
Vector2d centre_of_turning(const std::vector<SetupAtRotation>& setups) {
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  for (const SetupAtRotation& setup : setups) {
    const double c = std::cos(setup.rotation_rad);
    const double s = std::sin(setup.rotation_rad);
    Eigen::Matrix<double, 2, 4> row;
    row << 1.0, 0.0, c, -s, 0.0, 1.0, s, c;
    A += row.transpose() * row;
    b += row.transpose() * setup.principal_px;
  }
  return A.ldlt().solve(b).head<2>();
}

Expected<TurnedScope> fitted(const std::vector<SetupAtRotation>& setups, const std::optional<Vector2d>& turn_px) {
  TurnedScope scope;
  scope.turn_px = turn_px ? *turn_px : centre_of_turning(setups);
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
  if (turns.empty() || widest < kLeastTurnOfSetups_deg * kDegree) {
    return fail(
        "set-ups at two turns of the scope are needed, 20 degrees apart and more, better three: turn the scope in its "
        "camera head, and measure lens and hand-eye again");
  }
  scope.reference.principal_px = reference_principal(setups, scope);
  // A sensor that turns with the scope is not carried about at all.
  scope.sensor_on_scope = std::all_of(turns.begin(), turns.end(), [](const Turns& turn) {
    return so3_log(turn.carried.R).norm() < std::min(3.0 * kDegree, 0.2 * std::abs(turn.angle));
  });
  if (!scope.sensor_on_scope) {
    if (const auto axis = fit_axis(turns, scope); !axis) return tl::unexpected(axis.error());
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
  return scope;
}

// What a set-up's own number, off by a deviation, makes of all that follows from it.
class Deviations {
 public:
  explicit Deviations(const TurnedScope& scope) : scope_(scope) { principal_.fill(Vector2d::Zero()); }

  void add(const Expected<TurnedScope>& moved) {
    if (!moved) return;
    axis_ += (moved->axis_S - scope_.axis_S).squaredNorm();
    const Vector3d on_axis = moved->point_S - scope_.point_S;
    point_ += (on_axis - scope_.axis_S * scope_.axis_S.dot(on_axis)).squaredNorm();
    for (std::size_t i = 0; i < kTurns; ++i) {
      const double angle = kTwoPi * static_cast<double>(i) / kTurns;
      const SetupAtRotation before = scope_.at(angle);
      const SetupAtRotation after = moved->at(angle);
      rotation_[i] += so3_log(before.X_SC.R.transpose() * after.X_SC.R).squaredNorm();
      translation_[i] += (after.X_SC.t - before.X_SC.t).squaredNorm();
      const Vector2d point = after.principal_px - before.principal_px;
      principal_[i] += point.cwiseAbs2();
      if (!(scope_.reference.focal_px.minCoeff() > 0.0)) continue;
      const Vector2d aside = -point.cwiseQuotient(scope_.reference.focal_px);
      const Vector3d ahead_C = TurnedScope::kTargetAhead_mm * Vector3d::UnitZ();
      const Vector3d told_C = TurnedScope::kTargetAhead_mm * Vector3d(aside.x(), aside.y(), 1.0);
      target_[i] += (after.X_SC * told_C - before.X_SC * ahead_C).squaredNorm();
    }
  }

  void tell(TurnedScope& scope) const {
    scope.axis_deviation_rad = std::sqrt(axis_);
    scope.point_deviation_mm = std::sqrt(point_);
    for (std::size_t i = 0; i < kTurns; ++i) {
      scope.rotation_deviation_rad = std::max(scope.rotation_deviation_rad, std::sqrt(rotation_[i]));
      scope.translation_deviation_mm = std::max(scope.translation_deviation_mm, std::sqrt(translation_[i]));
      scope.principal_deviation_px = std::max(scope.principal_deviation_px, std::sqrt(principal_[i].maxCoeff()));
      scope.target_deviation_mm = std::max(scope.target_deviation_mm, std::sqrt(target_[i]));
    }
  }

 private:
  static constexpr std::size_t kTurns = 12;

  const TurnedScope& scope_;
  double axis_ = 0.0;
  double point_ = 0.0;
  std::array<double, kTurns> rotation_{};
  std::array<double, kTurns> translation_{};
  std::array<double, kTurns> target_{};
  std::array<Vector2d, kTurns> principal_;
};

// Each set-up by the others, where those alone make a function.
void hold_aside(const std::vector<SetupAtRotation>& setups, const std::optional<Vector2d>& turn_px,
                TurnedScope& scope) {
  constexpr std::size_t kFewest = 3;
  if (setups.size() < kFewest) return;
  double rotation = 0.0;
  double translation = 0.0;
  double tried = 0.0;
  for (std::size_t i = 0; i < setups.size(); ++i) {
    std::vector<SetupAtRotation> others = setups;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    // The centre does nothing to the hand-eye, and two principal points tell it badly.
    const auto by_others = fitted(others, turn_px ? turn_px : std::optional(scope.turn_px));
    if (!by_others) continue;
    const Pose error = by_others->at(setups[i].rotation_rad).X_SC.inverse() * setups[i].X_SC;
    rotation += std::pow(so3_log(error.R).norm() / kDegree, 2.0);
    translation += error.t.squaredNorm();
    tried += 1.0;
  }
  if (tried == 0.0) return;
  scope.aside_rotation_rms_deg = std::sqrt(rotation / tried);
  scope.aside_translation_rms_mm = std::sqrt(translation / tried);
}

// Each independent part of each set-up's error in turn, one deviation large.
void tell_deviations(const std::vector<SetupAtRotation>& setups, const std::optional<Vector2d>& turn_px,
                     TurnedScope& scope) {
  Deviations deviations(scope);
  for (std::size_t i = 0; i < setups.size(); ++i) {
    Eigen::Matrix<double, 8, 8> together;
    together << setups[i].covariance_C, setups[i].covariance_with_principal,
        setups[i].covariance_with_principal.transpose(),
        Eigen::Matrix2d(setups[i].principal_deviation_px.cwiseAbs2().asDiagonal());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 8, 8>> parts(together);
    for (int k = 0; k < 8; ++k) {
      const double deviation = std::sqrt(std::max(0.0, parts.eigenvalues()[k]));
      if (deviation == 0.0) continue;
      const Eigen::Matrix<double, 8, 1> off = deviation * parts.eigenvectors().col(k);
      std::vector<SetupAtRotation> moved = setups;
      moved[i].X_SC = moved[i].X_SC * Pose{so3_exp(off.head<3>()), off.segment<3>(3)};
      moved[i].principal_px += off.tail<2>();
      deviations.add(fitted(moved, turn_px));
    }
    std::vector<SetupAtRotation> moved = setups;
    moved[i].rotation_rad += setups[i].rotation_deviation_rad;
    deviations.add(fitted(moved, turn_px));
  }
  deviations.tell(scope);
}

}  // namespace

Expected<TurnedScope> fit_turned_scope(const std::vector<SetupAtRotation>& setups,
                                       const std::optional<Vector2d>& turn_px) {
  constexpr std::size_t kFewestForCentre = 3;
  if (!turn_px && setups.size() < kFewestForCentre) {
    return fail("set-ups at three turns of the scope are needed to tell about which point of the picture it turns");
  }
  auto scope = fitted(setups, turn_px);
  if (!scope) return scope;
  if (const auto one = check_zooms(setups); !one) return tl::unexpected(one.error());
  std::vector<FocalAtRadius> focals;
  for (const SetupAtRotation& setup : setups) {
    if (setup.radius_px > 0.0) focals.push_back({setup.radius_px, setup.focal_px});
  }
  scope->focals = focal_table(std::move(focals));
  if (!scope->focals.empty()) scope->reference.focal_px = scope->focals.front().focal_px;
  constexpr double kMost_deg = 1.0;
  constexpr double kMost_mm = 2.0;
  if (scope->rotation_rms_deg > kMost_deg || scope->translation_rms_mm > kMost_mm) {
    return fail("the set-ups do not fit one turning scope (" + std::to_string(scope->rotation_rms_deg) +
                " degrees and " + std::to_string(scope->translation_rms_mm) +
                " mm RMS are left over): measure each with the scope held at its turn, and the sensor fast");
  }
  tell_deviations(setups, turn_px, *scope);
  hold_aside(setups, turn_px, *scope);
  return scope;
}

}  // namespace perimap
