// Hand-eye and time offset, the lens being known.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/angle/angle.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "drawn_setup.hpp"
#include "setups.hpp"

namespace perimap::test {
namespace {

// A camera's pose by a board as it is off by the corners' noise: drawn from what least squares over them would have.
Pose seen_with_noise(Draw& draw, const CameraModel& camera, const std::vector<Vector3d>& board, const Pose& X_BC,
                     double px) {
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  const Pose X_CB = X_BC.inverse();
  for (const Vector3d& p_B : board) {
    const Vector3d p_C = X_CB * p_B;
    Vector2d at;
    Matrix23d J;
    if (camera.project(p_C, at, &J) != ProjectionStatus::kOk || !camera.contains(at)) continue;
    Eigen::Matrix<double, 3, 6> move;  // of p_C as C is turned and moved by a small step in itself
    move << cross_matrix(p_C), -Matrix3d::Identity();
    information += move.transpose() * J.transpose() * J * move / (px * px);
  }
  const Eigen::Matrix<double, 6, 6> root = information.inverse().llt().matrixL();
  Vector6d e;
  for (int i = 0; i < 6; ++i) e[i] = draw.normal(1.0);
  e = root * e;
  return X_BC * Pose{so3_exp(e.head<3>()), e.tail<3>()};
}

struct HandEyeTrial {
  bool refused = true;
  double rotation_deg = 99.0, translation_mm = 99.0, target_mm = 99.0, offset_ms = 99.0;
  HandEyeNees nees;
  double duration_s = 99.0;
};

std::vector<TimedPose> until(const std::vector<TimedPose>& poses, double t_s) {
  return {poses.begin(),
          std::find_if(poses.begin(), poses.end(), [&](const TimedPose& pose) { return pose.t_s > t_s; })};
}

// 40 s of it; of errors that last as much more, of `longest_s` at most, as the guide of a live calibration asks for.
Expected<HandEyeCalibration> guided(const std::vector<TimedPose>& seen, const std::vector<TimedPose>& tracked,
                                    double offset_s, double longest_s, double& duration_s) {
  constexpr double kEvery_s = 40.0;
  for (duration_s = 40.0;; duration_s += kEvery_s) {
    auto result = calibrate_hand_eye(until(seen, duration_s), until(tracked, duration_s + 1.0 - offset_s), {});
    const bool enough = result && result->target_deviation_mm() <= HandEyeCalibration::kWellKnownTarget_mm;
    if (enough || duration_s >= longest_s) return result;
  }
}

HandEyeTrial hand_eye_trial(std::uint64_t seed, double correlation_s) {
  Draw draw(seed);
  const CameraModel camera = drawn_camera(draw);
  const auto board = chessboard(9, 6, 8.0);
  const Pose X_SC{so3_exp(draw.vector(0.8)), Vector3d(0.0, 0.0, 200.0) + draw.vector(40.0)};
  const Pose X_WB{so3_exp(draw.vector(1.0)), draw.vector(300.0)};
  const double offset_s = draw.uniform(-0.5, 0.5);
  const HandMotion motion(draw, 40.0, 40.0);
  // The camera looks at the board from 100 mm, and is swayed and turned about the board's middle.
  const auto X_BC_at = [&](double t_s) {
    const Vector6d m = motion.at(t_s);
    const Vector3d middle(32.0, 20.0, 0.0);
    const Pose look{so3_exp(Vector3d(std::numbers::pi, 0.0, 0.0)), middle + Vector3d(0.0, 0.0, 100.0)};
    const Pose swing{so3_exp(m.head<3>()), middle + m.tail<3>() * 0.5};
    return swing * Pose{Matrix3d::Identity(), -middle} * look;
  };
  std::vector<TimedPose> seen;
  std::vector<TimedPose> tracked;
  // As long as `perimap calibrate --live` records at most.
  const double longest_s = correlation_s > 0.0 ? 120.0 : 40.0;
  for (double t = 0.0; t < longest_s; t += 1.0 / 30.0) {
    if (draw.chance(0.1)) continue;  // the board is not seen
    seen.push_back({t, seen_with_noise(draw, camera, board, X_BC_at(t), 0.3)});
  }
  const double interval_s = 1.0 / 60.0;
  TrackerError error(draw, correlation_s, interval_s);
  for (double t = -1.0; t < longest_s + 1.0; t += interval_s) {
    tracked.push_back({t - offset_s, error.of(X_WB * X_BC_at(t) * X_SC.inverse())});
  }
  double duration_s = 0.0;
  const auto result = guided(seen, tracked, offset_s, longest_s, duration_s);
  if (!result) {
    fmt::print("seed {}: {}\n", seed, result.error().message);
    return {};
  }
  const Pose off = result->X_SC.inverse() * X_SC;  // X_SC = estimate * exp(error)
  Vector7d e;
  e << so3_log(off.R), off.t, offset_s - result->offset_s;
  const Vector3d target_C(0.0, 0.0, 90.0);
  return {false,
          e.head<3>().norm() / kDegree,
          e.segment<3>(3).norm(),
          (result->X_SC * target_C - X_SC * target_C).norm(),
          1e3 * std::abs(e[6]),
          nees_of(e, result->covariance),
          duration_s};
}

}  // namespace

void hand_eyes(std::uint64_t seed, int trials, double correlation_s, GoalReport& report) {
  std::vector<double> rotation, translation, target, offset, duration;
  MeanOfMeasured all, by_rotation, by_translation, by_offset;
  for (int i = 0; i < trials; ++i) {
    const HandEyeTrial trial = hand_eye_trial(seed + static_cast<std::uint64_t>(i), correlation_s);
    rotation.push_back(trial.rotation_deg), translation.push_back(trial.translation_mm);
    target.push_back(trial.target_mm), offset.push_back(trial.offset_ms), duration.push_back(trial.duration_s);
    if (trial.refused) continue;
    all.add(trial.nees.all), by_rotation.add(trial.nees.rotation);
    by_translation.add(trial.nees.translation), by_offset.add(trial.nees.offset);
  }
  const std::string noise = correlation_s > 0.0 ? fmt::format(", tracker's error of {:g} s", correlation_s) : "";
  const auto tell = [&](const std::string& what, double goal, const std::vector<double>& values) {
    report.at_most(what + ", 95 %" + noise, goal, percentile(values, 0.95));
  };
  tell("hand-eye rotation, degrees", 0.3, rotation);
  tell("hand-eye translation, mm", 0.7, translation);
  tell("a target 90 mm ahead, mm", 1.0, target);
  tell("time offset, ms", 2.0, offset);
  report.at_most("hand-eyes refused, %" + noise, kMostRefused_percent, all.refused_percent(trials));
  if (correlation_s == 0.0) {
    report.within("hand-eye and time, NEES/7" + noise, 0.8, 1.2, all.mean());
    report.shown("  its rotation, NEES/3" + noise, "", by_rotation.mean());
    report.shown("  its translation, NEES/3" + noise, "", by_translation.mean());
    // Of one number a set-up: what fifty tell scatters by 0.2.
    constexpr int kEnough = 200;
    if (trials >= kEnough) {
      report.within("  the offset, NEES" + noise, 0.8, 1.2, by_offset.mean());
    } else {
      report.shown("  the offset, NEES" + noise, "", by_offset.mean());
    }
  } else {
    report.shown("hand-eye and time, NEES/7" + noise, "", all.mean());
    report.shown("seconds of recording, median" + noise, "", percentile(duration, 0.5));
  }
}

}  // namespace perimap::test
