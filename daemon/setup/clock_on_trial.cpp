#include "daemon/setup/clock_on_trial.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/calibration/hand_eye_closed_form.hpp"
#include "core/calibration/variance_of_sum.hpp"

namespace perimap {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

namespace {

// From X to Y, in the frame that moves: rotation, rad, then translation, mm.
Vector6d way(const Pose& X, const Pose& Y) {
  Vector6d w;
  w << so3_log(X.R.transpose() * Y.R), X.R.transpose() * (Y.t - X.t);
  return w;
}

// The slope of a line through the poses over 60 ms to both sides, five of them at least: nearer ones would tell the
// tracker's noise as speed. None at the ends and in gaps.
std::optional<Vector6d> twist_around(const std::vector<TimedPose>& sensor, const Pose& X, double t_s,
                                     double interval_s) {
  const double half_s = std::max(0.06, 2.5 * interval_s);
  auto at = std::lower_bound(sensor.begin(), sensor.end(), t_s - half_s,
                             [](const TimedPose& pose, double t) { return pose.t_s < t; });
  double n = 0.0;
  double sum_t = 0.0;
  double sum_tt = 0.0;
  Vector6d sum = Vector6d::Zero();
  Vector6d sum_tw = Vector6d::Zero();
  for (; at != sensor.end() && at->t_s <= t_s + half_s; ++at) {
    const double t = at->t_s - t_s;
    const Vector6d w = way(X, at->X);
    n += 1.0;
    sum_t += t;
    sum_tt += t * t;
    sum += w;
    sum_tw += t * w;
  }
  const double whole = 2.0 * half_s / interval_s;
  if (n < std::max(4.0, 0.8 * whole)) return std::nullopt;
  const double spread = sum_tt - sum_t * sum_t / n;
  if (!(spread > 0.0)) return std::nullopt;
  return Vector6d((sum_tw - sum_t / n * sum) / spread);
}

// Of one of the tracker's poses, by second differences; and a little for what the camera's are off.
Matrix6d noise_of(const std::vector<TimedPose>& sensor, double interval_s) {
  Vector6d floor;
  floor << Vector3d::Constant(1e-7), Vector3d::Constant(1e-3);  // 0.02 degrees, 0.03 mm
  Matrix6d sum = Matrix6d::Zero();
  double n = 0.0;
  for (std::size_t i = 1; i + 1 < sensor.size(); ++i) {
    if (sensor[i + 1].t_s - sensor[i - 1].t_s > 2.5 * interval_s) continue;
    const Vector6d w = 0.5 * (way(sensor[i].X, sensor[i - 1].X) + way(sensor[i].X, sensor[i + 1].X));
    sum += w * w.transpose() / 1.5;
    n += 1.0;
  }
  return sum / std::max(1.0, n) + Matrix6d(floor.asDiagonal());
}

// How an error of where W is, to the left of the board's pose, is felt in S.
Matrix6d felt_in_sensor(const Pose& X_WS, const Vector3d& middle_W) {
  const Matrix3d R_SW = X_WS.R.transpose();
  Matrix6d felt = Matrix6d::Zero();
  felt.topLeftCorner<3, 3>() = R_SW;
  felt.bottomLeftCorner<3, 3>() = -R_SW * cross_matrix(X_WS.t - middle_W);
  felt.bottomRightCorner<3, 3>() = R_SW;
  return felt;
}

// Six rows of each view, of unit variance.
struct Equations {
  Eigen::MatrixXd others;  // of the board in W, and of the hand-eye
  Eigen::VectorXd twist;
  Eigen::VectorXd error;
};

std::optional<Equations> equations_of(const std::vector<TimedPose>& camera, const std::vector<TimedPose>& sensor,
                                      const Pose& X_SC, double offset_s) {
  constexpr std::size_t kFewest = 20;
  const double interval_s = median_interval_s(sensor);
  const double gap_s = longest_gap_s(sensor);
  std::vector<PosePair> pairs;
  for (const TimedPose& view : camera) {
    const double t_s = view.t_s - offset_s;
    const auto at = pose_at(sensor, t_s, gap_s);
    if (!at) continue;
    if (const auto twist = twist_around(sensor, at->X, t_s, interval_s)) {
      pairs.push_back({view.t_s, at->X, view.X, *twist});
    }
  }
  if (pairs.size() < kFewest) return std::nullopt;
  const Pose X_WB = board_in_world(pairs, X_SC);
  const Eigen::LLT<Matrix6d> noise(noise_of(sensor, interval_s));
  Equations e;
  const auto rows = static_cast<Eigen::Index>(6 * pairs.size());
  e.others.resize(rows, 12);
  e.twist.resize(rows);
  e.error.resize(rows);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(6 * i);
    e.others.block<6, 6>(row, 0) = noise.matrixL().solve(felt_in_sensor(pairs[i].X_WS, pairs.front().X_WS.t));
    e.others.block<6, 6>(row, 6) = noise.matrixL().solve(Matrix6d::Identity());
    e.twist.segment<6>(row) = noise.matrixL().solve(pairs[i].twist_S);
    e.error.segment<6>(row) = noise.matrixL().solve(hand_eye_error(pairs[i], X_SC, X_WB));
  }
  return e;
}

}  // namespace

std::optional<ClockError> clock_error(const std::vector<TimedPose>& camera, const std::vector<TimedPose>& sensor,
                                      const Pose& X_SC, double offset_s) {
  // What noise does to the twists makes each step too short, and the last of several right.
  constexpr int kSteps = 4;
  ClockError result;
  for (int step = 0; step < kSteps; ++step) {
    const auto e = equations_of(camera, sensor, X_SC, offset_s + result.change_s);
    if (!e) return std::nullopt;
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> others(e->others);
    const Eigen::VectorXd twist = e->twist - e->others * others.solve(e->twist);
    const Eigen::VectorXd error = e->error - e->others * others.solve(e->error);
    const double H = twist.squaredNorm();
    if (!(H > 0.0)) return std::nullopt;
    const double change_s = -twist.dot(error) / H;
    result.change_s += change_s;
    std::vector<double> scores;
    double alone = 0.0;
    for (Eigen::Index i = 0; i < twist.size(); i += 6) {
      scores.push_back(twist.segment<6>(i).dot(error.segment<6>(i) + change_s * twist.segment<6>(i)));
      alone += scores.back() * scores.back();
    }
    const auto n = static_cast<double>(twist.size());
    // What the other unknowns take of the errors leaves neighbours that seem to cancel: never less than of white ones.
    result.deviation_s = std::sqrt(std::max(alone, variance_of_sum(scores)) * n / (n - 13.0)) / H;
  }
  return result;
}

}  // namespace perimap
