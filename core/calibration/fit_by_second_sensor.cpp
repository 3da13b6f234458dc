#include "core/calibration/fit_by_second_sensor.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/angle/angle.hpp"
#include "core/calibration/residual_correlation.hpp"

namespace perimap {
namespace {

Matrix3d mean_of(const std::vector<Matrix3d>& rotations) {
  Matrix3d mean = rotations.front();
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    Vector3d off = Vector3d::Zero();
    for (const Matrix3d& R : rotations) off += so3_log(mean.transpose() * R) / static_cast<double>(rotations.size());
    mean = mean * so3_exp(off);
  }
  return mean;
}

// The axis of all turns from the first relation, those that turn farther counting more.
Expected<SecondSensor> axis_of(const std::vector<HeldRelation>& held) {
  SecondSensor second;
  second.reference_S2 = held.front().R_S2;
  Matrix3d products = Matrix3d::Zero();
  double widest_rad = 0.0;
  for (const HeldRelation& relation : held) {
    const Vector3d turn = so3_log(relation.R_S2 * second.reference_S2.transpose());
    products += turn * turn.transpose();
    widest_rad = std::max(widest_rad, turn.norm());
  }
  if (widest_rad < kLeastTurnOfSetups_deg * kDegree) {
    return fail("the second sensor turned by " + std::to_string(widest_rad / kDegree) +
                " degrees at most in the frame of the first: one must be fast on the camera head and the other one on "
                "the scope, and the scope be held at turns 20 degrees apart and more, better 60");
  }
  second.axis_S = Eigen::SelfAdjointEigenSolver<Matrix3d>(products).eigenvectors().col(2);
  double squares = 0.0;
  for (const HeldRelation& relation : held) squares += std::pow(second.aside_rad(relation.R_S2), 2.0);
  second.left_over_rad = std::sqrt(squares / static_cast<double>(held.size() - 1));
  constexpr double kMost_rad = 2.0 * kDegree;
  if (second.left_over_rad > kMost_rad) {
    return fail("the second sensor does not turn about one axis in the frame of the first (" +
                std::to_string(second.left_over_rad / kDegree) +
                " degrees RMS are left over): one must be fast on the camera head, the other one on the scope");
  }
  return second;
}

// How far the set-ups are from the function in all, squared: by the lens's direction, and by where the principal point
// has gone, as an angle too. The hand-eye of a scope that looks straight ahead fits either way round of the axis; its
// principal point does not.
double left_over_rad2(const TurnedScope& scope, const std::vector<SetupAtRotation>& setups) {
  constexpr double kUsualFocal_px = 1000.0;  // where none is told
  double squares = 0.0;
  for (const SetupAtRotation& setup : setups) {
    const SetupAtRotation expected = scope.at(setup.rotation_rad);
    const double focal_px = setup.focal_px.x() > 0.0 ? setup.focal_px.x() : kUsualFocal_px;
    squares += so3_log(expected.X_SC.R.transpose() * setup.X_SC.R).squaredNorm();
    squares += (expected.principal_px - setup.principal_px).squaredNorm() / (focal_px * focal_px);
  }
  return squares;
}

}  // namespace

double relation_window_s(const std::vector<TimedPose>& second) {
  constexpr double kShortest_s = 0.5, kIntervals = 6.0;
  return std::max(kShortest_s, kIntervals * median_interval_s(second));
}

std::vector<TimedTurn> relations_over(const std::vector<TimedPose>& sensor, const std::vector<TimedPose>& second,
                                      double each_s) {
  constexpr std::size_t kFewestPairs = 5;
  const double gap_s = longest_gap_s(sensor);
  std::vector<TimedTurn> relations;
  std::vector<Matrix3d> within;
  double begin_s = 0.0, last_s = 0.0;
  const auto end_stretch = [&] {
    if (within.size() >= kFewestPairs) relations.push_back({0.5 * (begin_s + last_s), mean_of(within)});
    within.clear();
  };
  for (const TimedPose& pose : second) {
    const auto at = pose_at(sensor, pose.t_s, gap_s);
    if (!at) continue;
    if (!within.empty() && pose.t_s >= begin_s + each_s) end_stretch();
    if (within.empty()) begin_s = pose.t_s;
    last_s = pose.t_s;
    within.emplace_back(at->X.R.transpose() * pose.X.R);
  }
  end_stretch();
  return relations;
}

Expected<HeldRelation> held_relation(const std::vector<TimedPose>& sensor, const std::vector<TimedPose>& second) {
  constexpr std::size_t kFewest = 5;
  constexpr double kSecond_s = 1.0;
  std::vector<Matrix3d> seconds;
  for (const TimedTurn& relation : relations_over(sensor, second, kSecond_s)) seconds.push_back(relation.R);
  if (seconds.size() < kFewest) {
    return fail("the two sensors are seen together for " + std::to_string(seconds.size()) +
                " seconds only: keep both in sight of the tracker for five and more");
  }
  HeldRelation held;
  held.R_S2 = mean_of(seconds);
  std::vector<double> off_axis[3];
  double squares = 0.0;
  double farthest_rad = 0.0;
  for (const Matrix3d& R : seconds) {
    const Vector3d off = so3_log(held.R_S2.transpose() * R);
    for (int k = 0; k < 3; ++k) off_axis[k].push_back(off[k]);
    squares += off.squaredNorm();
    farthest_rad = std::max(farthest_rad, off.norm());
  }
  const auto count = static_cast<double>(seconds.size());
  held.spread_rad = std::sqrt(squares / (3.0 * (count - 1.0)));
  // Slow errors are common to seconds that follow each other.
  double length = 0.0;
  for (const std::vector<double>& off : off_axis) length += correlation_length(off) / 3.0;
  held.deviation_rad = held.spread_rad * std::sqrt(std::max(1.0, length) / count);
  constexpr double kHeld_rad = 3.0 * kDegree;
  if (farthest_rad > kHeld_rad) {
    return fail("the scope was turned in its camera head meanwhile, or a sensor is loose (" +
                std::to_string(farthest_rad / kDegree) +
                " degrees off the mean for a second): hold it at one turn, and record again");
  }
  return held;
}

Expected<TurnedScope> fit_by_second_sensor(std::vector<SetupAtRotation> setups, const std::vector<HeldRelation>& held) {
  constexpr std::size_t kFewest = 3;
  if (setups.size() < kFewest || setups.size() != held.size()) {
    return fail(
        "set-ups at three turns of the scope are needed, 20 degrees apart and more, better 60: turn the scope in its "
        "camera head, and measure lens and hand-eye again");
  }
  auto second = axis_of(held);
  if (!second) return tl::unexpected(second.error());
  Expected<TurnedScope> best = fail("");
  double least_rad2 = 0.0;
  for (const double way : {1.0, -1.0}) {
    SecondSensor turned = *second;
    turned.axis_S *= way;
    for (std::size_t i = 0; i < setups.size(); ++i) {
      setups[i].rotation_rad = turned.rotation_rad(held[i].R_S2);
      setups[i].rotation_deviation_rad = held[i].deviation_rad;
      setups[i].radius_px = 0.0;  // nobody looks for a field stop
    }
    auto scope = fit_turned_scope(setups, std::nullopt);
    if (!scope) {
      if (!best && best.error().message.empty()) best = tl::unexpected(scope.error());
      continue;
    }
    const double rad2 = left_over_rad2(*scope, setups);
    if (best && rad2 >= least_rad2) continue;
    scope->second_sensor = turned;
    least_rad2 = rad2;
    best = *std::move(scope);
  }
  return best;
}

}  // namespace perimap
