// Set-ups drawn at random and measured: errors beside what was to be reached, and deviations beside the errors
// (docs/evidence/setup.md). Exit code 1 when a goal is missed.
#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/calibration/field_stop.hpp"
#include "core/calibration/pivot.hpp"
#include "core/calibration/tracker_noise.hpp"
#include "core/calibration/turned_scope.hpp"
#include "daemon/setup/camera_calibration.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/signal_offset.hpp"
#include "drivers/standins/simulator/field_stop.hpp"
#include "drivers/standins/simulator/scope_setup.hpp"
#include "goal_report.hpp"

namespace perimap::test {
namespace {

constexpr double kTracker_mm = 1.4;   // RMS of the 3-D norm
constexpr double kTracker_deg = 0.5;  // likewise

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : generator_(seed) {}
  double normal(double deviation) { return deviation * normal_(generator_); }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }
  Vector3d vector(double deviation) { return {normal(deviation), normal(deviation), normal(deviation)}; }
  bool chance(double share) { return uniform(0.0, 1.0) < share; }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

// A smooth motion as of a hand: sines of drawn periods, amplitudes and phases.
class HandMotion {
 public:
  HandMotion(Draw& draw, double mm, double deg) : mm_(mm), deg_(deg) {
    for (auto& axis : waves_) {
      for (auto& wave : axis) wave = {draw.uniform(0.5, 1.0), draw.uniform(0.1, 0.8), draw.uniform(0.0, 6.3)};
    }
  }
  [[nodiscard]] Vector6d at(double t_s) const {
    Vector6d value;
    for (int axis = 0; axis < 6; ++axis) {
      double sum = 0.0;
      for (const auto& [a, f, p] : waves_[static_cast<std::size_t>(axis)])
        sum += a * std::sin(2.0 * std::numbers::pi * f * t_s + p) / 3.0;
      value[axis] = sum * (axis < 3 ? deg_ * kDegree : mm_);
    }
    return value;
  }

 private:
  double mm_;
  double deg_;
  std::array<std::array<std::array<double, 3>, 3>, 6> waves_{};
};

CameraModel drawn_camera(Draw& draw) {
  CameraModel camera;
  camera.width = 1280, camera.height = 720;
  camera.fx = draw.uniform(900.0, 1200.0);
  camera.fy = camera.fx * draw.uniform(0.99, 1.01);
  camera.cx = 640.0 + draw.normal(20.0), camera.cy = 360.0 + draw.normal(20.0);
  camera.k1 = draw.uniform(-0.35, -0.1), camera.k2 = draw.uniform(0.0, 0.12);
  camera.p1 = draw.normal(5e-4), camera.p2 = draw.normal(5e-4);
  return camera;
}

std::vector<Vector3d> chessboard(int columns, int rows, double square_mm) {
  std::vector<Vector3d> points;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) points.push_back(square_mm * Vector3d(x, y, 0.0));
  }
  return points;
}

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

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

struct HandEyeTrial {
  double rotation_deg, translation_mm, target_mm, offset_ms, nees;
  double duration_s;
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
  const double rho = correlation_s > 0.0 ? std::exp(-interval_s / correlation_s) : 0.0;
  Vector3d place = draw.vector(kTracker_mm / std::sqrt(3.0)),
           turn = draw.vector(kTracker_deg * kDegree / std::sqrt(3.0));
  for (double t = -1.0; t < longest_s + 1.0; t += interval_s) {
    const double fresh = std::sqrt(1.0 - rho * rho);
    place = rho * place + draw.vector(fresh * kTracker_mm / std::sqrt(3.0));
    turn = rho * turn + draw.vector(fresh * kTracker_deg * kDegree / std::sqrt(3.0));
    const Pose X_WS = X_WB * X_BC_at(t) * X_SC.inverse();
    tracked.push_back({t - offset_s, {X_WS.R * so3_exp(turn), X_WS.t + place}});
  }
  double duration_s = 0.0;
  const auto result = guided(seen, tracked, offset_s, longest_s, duration_s);
  if (!result) {
    fmt::print("seed {}: {}\n", seed, result.error().message);
    return {99, 99, 99, 99, 99, 99};
  }
  const Pose error = result->X_SC.inverse() * X_SC;  // X_SC = estimate * exp(error)
  Eigen::Matrix<double, 7, 1> e;
  e << so3_log(error.R), error.t, offset_s - result->offset_s;
  const Vector3d target_C(0.0, 0.0, 90.0);
  return {e.head<3>().norm() / kDegree,
          e.segment<3>(3).norm(),
          (result->X_SC * target_C - X_SC * target_C).norm(),
          1e3 * std::abs(e[6]),
          e.dot(result->covariance.ldlt().solve(e)) / 7.0,
          duration_s};
}

void hand_eyes(std::uint64_t seed, int trials, double correlation_s, GoalReport& report) {
  std::vector<double> rotation, translation, target, offset, duration;
  double nees = 0.0;
  for (int i = 0; i < trials; ++i) {
    const HandEyeTrial trial = hand_eye_trial(seed + static_cast<std::uint64_t>(i), correlation_s);
    rotation.push_back(trial.rotation_deg), translation.push_back(trial.translation_mm);
    target.push_back(trial.target_mm), offset.push_back(trial.offset_ms), duration.push_back(trial.duration_s);
    nees += trial.nees / trials;
  }
  const std::string noise = correlation_s > 0.0 ? fmt::format(", tracker's error of {:g} s", correlation_s) : "";
  const auto tell = [&](const std::string& what, double goal, const std::vector<double>& values) {
    report.at_most(what + ", 95 %" + noise, goal, percentile(values, 0.95));
  };
  tell("hand-eye rotation, degrees", 0.3, rotation);
  tell("hand-eye translation, mm", 0.7, translation);
  tell("a target 90 mm ahead, mm", 1.0, target);
  tell("time offset, ms", 2.0, offset);
  if (correlation_s == 0.0) {
    report.within("hand-eye and time, NEES/7" + noise, 0.8, 1.2, nees);
  } else {
    report.shown("hand-eye and time, NEES/7" + noise, "", nees);
    report.shown("seconds of recording, median" + noise, "", percentile(duration, 0.5));
  }
}

void cameras(std::uint64_t seed, int trials, std::size_t view_count, GoalReport& report) {
  std::vector<double> focal, centre;
  double nees = 0.0;
  for (int i = 0; i < trials; ++i) {
    Draw draw(seed + static_cast<std::uint64_t>(i));
    const CameraModel camera = drawn_camera(draw);
    const auto board = chessboard(9, 6, 8.0);
    std::vector<BoardView> views;
    while (views.size() < view_count) {
      const Pose X_CB{so3_exp(Vector3d(draw.uniform(-0.7, 0.7), draw.uniform(-0.7, 0.7), draw.uniform(-1.6, 1.6))),
                      Vector3d(draw.uniform(-25.0, 25.0), draw.uniform(-15.0, 15.0), draw.uniform(80.0, 140.0))};
      BoardView view;
      view.name = fmt::format("{}", views.size());
      for (const Vector3d& p_B : board) {
        Vector2d px;
        const Vector3d p_C = X_CB * (p_B - Vector3d(32.0, 20.0, 0.0));
        if (camera.project(p_C, px) != ProjectionStatus::kOk || !camera.contains(px)) break;
        view.board_mm.push_back(p_B);
        view.px.push_back(px + Vector2d(draw.normal(0.3), draw.normal(0.3)));
      }
      if (view.px.size() == board.size()) views.push_back(view);
    }
    const auto result = calibrate_camera(views, camera.width, camera.height, {});
    if (!result) {
      fmt::print("seed {}: {}\n", i, result.error().message);
      focal.push_back(99), centre.push_back(99);
      continue;
    }
    Eigen::Matrix4d C;
    for (int a = 0; a < 4; ++a) {
      for (int b = 0; b < 4; ++b)
        C(a, b) = result->covariance[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)];
    }
    const CameraModel& c = result->camera;
    const Eigen::Vector4d e(c.fx - camera.fx, c.fy - camera.fy, c.cx - camera.cx, c.cy - camera.cy);
    focal.push_back(100.0 * std::max(std::abs(e[0]) / camera.fx, std::abs(e[1]) / camera.fy));
    centre.push_back(e.tail<2>().norm());
    nees += e.dot(C.ldlt().solve(e)) / 4.0 / trials;
  }
  const std::string by = fmt::format(", {} views", view_count);
  report.at_most("focal length, %, 95 %" + by, 0.3, percentile(focal, 0.95));
  report.at_most("principal point, px, 95 %" + by, 2.0, percentile(centre, 0.95));
  report.within("focal lengths and principal point, NEES/4" + by, 0.7, 1.3, nees);  // of 200: 0.80 to 1.20 (95 %)
}

void tools(std::uint64_t seed, int trials, GoalReport& report) {
  std::vector<double> tip;
  double nees = 0.0;
  for (int i = 0; i < trials; ++i) {
    Draw draw(seed + static_cast<std::uint64_t>(i));
    const Vector3d tip_T = Vector3d(0.0, 0.0, draw.uniform(80.0, 250.0)) + draw.vector(10.0);
    const Vector3d pivot_W = draw.vector(500.0);
    const HandMotion motion(draw, 0.0, 50.0);
    std::vector<TimedPose> poses;
    for (double t = 0.0; t < 20.0; t += 1.0 / 60.0) {
      Pose X;
      X.R = so3_exp(motion.at(t).head<3>());
      X.t = pivot_W - X.R * tip_T + draw.vector(kTracker_mm / std::sqrt(3.0));
      X.R = X.R * so3_exp(draw.vector(kTracker_deg * kDegree / std::sqrt(3.0)));
      poses.push_back({t, X});
    }
    const auto result = calibrate_pivot(poses);
    if (!result) {
      fmt::print("seed {}: {}\n", i, result.error().message);
      tip.push_back(99);
      continue;
    }
    const Vector3d e = result->tip_T - tip_T;
    tip.push_back(e.norm());
    nees += e.dot(result->covariance_T.inverse() * e) / 3.0 / trials;
  }
  report.at_most("tool's tip, mm, 95 %", 0.5, percentile(tip, 0.95));
  report.within("tool's tip, NEES/3", 0.7, 1.3, nees);  // of 150: 0.77 to 1.23 by chance (95 %)
}

void trackers(std::uint64_t seed, int trials, GoalReport& report) {
  for (const double correlation_s : {0.0, 0.2, 1.0}) {
    std::vector<double> position, rotation, factor;
    double nees = 0.0;
    for (int i = 0; i < trials; ++i) {
      Draw draw(seed + static_cast<std::uint64_t>(i));
      const double interval_s = 1.0 / 60.0;
      const double rho = correlation_s > 0.0 ? std::exp(-interval_s / correlation_s) : 0.0;
      const double fresh = std::sqrt(1.0 - rho * rho);
      Vector3d place = draw.vector(kTracker_mm / std::sqrt(3.0)),
               turn = draw.vector(kTracker_deg * kDegree / std::sqrt(3.0));
      std::vector<TimedPose> poses;
      const double duration_s = correlation_s > 0.5 ? 120.0 : 60.0;
      for (double t = 0.0; t < duration_s; t += interval_s) {
        place = rho * place + draw.vector(fresh * kTracker_mm / std::sqrt(3.0));
        turn = rho * turn + draw.vector(fresh * kTracker_deg * kDegree / std::sqrt(3.0));
        poses.push_back({t, {so3_exp(turn), Vector3d(0.0, 100.0, -1200.0) + place}});
      }
      const auto noise = measure_tracker_noise(poses);
      if (!noise) {
        fmt::print("seed {}: {}\n", i, noise.error().message);
        position.push_back(99);
        continue;
      }
      position.push_back(100.0 * std::abs(noise->position_deviation_mm / kTracker_mm - 1.0));
      rotation.push_back(100.0 * std::abs(noise->rotation_deviation_deg / kTracker_deg - 1.0));
      const double position_off = (noise->position_deviation_mm - kTracker_mm) / noise->position_deviation_mm_deviation;
      const double rotation_off =
          (noise->rotation_deviation_deg - kTracker_deg) / noise->rotation_deviation_deg_deviation;
      nees += (position_off * position_off + rotation_off * rotation_off) / 2.0 / trials;
      factor.push_back(correlation_s == 0.0
                           ? 1.0 + noise->correlation_s
                           : std::exp(std::abs(std::log(std::max(1e-6, noise->correlation_s) / correlation_s))));
    }
    const std::string what = fmt::format(", an error of {:g} s, 95 %", correlation_s);
    report.at_most("tracker's position noise, %" + what, 15.0, percentile(position, 0.95));
    report.at_most("tracker's rotation noise, %" + what, 15.0, percentile(rotation, 0.95));
    report.at_most("its correlation time, factor" + what, 2.0, percentile(factor, 0.95));
    // A hundred numbers of one degree of freedom: 0.7 to 1.3 by chance (95 %).
    report.shown(fmt::format("both noises, NEES/2, an error of {:g} s", correlation_s), "0.8..1.2", nees);
  }
}

// A picture of the field stop with a camera's noise: brighter in its middle, with dark spots, as tissue has.
std::vector<std::uint8_t> field_stop_picture(Draw& draw, const FieldStop& stop, int width, int height) {
  std::vector<std::uint8_t> pixels;
  pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vector2d px(x, y);
      const double scene =
          120.0 - 2.5e-4 * (px - stop.centre_px).squaredNorm() + 25.0 * std::sin(0.05 * x) * std::sin(0.037 * y);
      const double level = 8.0 + scene * stop.passed(px) + draw.normal(4.0);
      pixels.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L)));
    }
  }
  return pixels;
}

// What lens and hand-eye calibrations leave at each turn, per axis: as the rows above have it.
constexpr double kHandEye_rad = 0.025 * kDegree;
constexpr double kHandEye_mm = 0.09;
constexpr double kPrincipal_px = 0.8;

struct ScopeTrial {
  std::vector<double> turns_deg;  // errors of each turn that was read
  double nees = 0.0;
  double target_mm = 99.0;
  double principal_px = 99.0;
};

// Three calibrated turns, and a fourth that nobody calibrated; each turn is read from a picture.
ScopeTrial scope_trial(std::uint64_t seed) {
  constexpr int kWidth = 1280;
  constexpr int kHeight = 720;
  Draw draw(seed);
  const ScopeSetup setup = drawn_setup(seed, kWidth, kHeight);
  const double first = draw.uniform(-3.1, 3.1);
  const std::vector<double> turns{first, first + 75.0 * kDegree, first + 150.0 * kDegree, draw.uniform(-3.1, 3.1)};
  std::vector<SetupAtRotation> setups;
  ScopeTrial trial;
  for (const double turn : turns) {
    const ScopeHeld held{std::remainder(turn, 2.0 * std::numbers::pi), 1.0};
    const FieldStop stop = drawn_field_stop(seed, kWidth, kHeight, held);
    const auto pixels = field_stop_picture(draw, stop, kWidth, kHeight);
    const auto reading = read_field_stop({pixels.data(), kWidth, kHeight, kWidth});
    if (!reading) {
      fmt::print("seed {}: {}\n", seed, reading.error().message);
      return trial;
    }
    const double off = std::remainder(reading->notch_rad - held.notch_rad, 2.0 * std::numbers::pi);
    trial.turns_deg.push_back(std::abs(off) / kDegree);
    trial.nees += std::pow(off / reading->notch_deviation_rad, 2.0) / static_cast<double>(turns.size());
    const ScopeSetup truth = turned_setup(setup, held, stop.centre_px);
    if (setups.size() < 3) {
      SetupAtRotation measured;
      measured.rotation_rad = reading->notch_rad;
      measured.rotation_deviation_rad = reading->notch_deviation_rad;
      measured.X_SC = truth.X_SC * Pose{so3_exp(draw.vector(kHandEye_rad)), draw.vector(kHandEye_mm)};
      measured.covariance_C.diagonal() << Vector3d::Constant(kHandEye_rad * kHandEye_rad),
          Vector3d::Constant(kHandEye_mm * kHandEye_mm);
      measured.principal_px =
          Vector2d(truth.lens.cx + draw.normal(kPrincipal_px), truth.lens.cy + draw.normal(kPrincipal_px));
      measured.principal_deviation_px = Vector2d::Constant(kPrincipal_px);
      measured.focal_px = {truth.lens.fx, truth.lens.fy};
      measured.radius_px = reading->radius_px;
      setups.push_back(measured);
      continue;
    }
    const auto fitted = fit_turned_scope(setups, stop.centre_px);
    if (!fitted) {
      fmt::print("seed {}: {}\n", seed, fitted.error().message);
      return trial;
    }
    const SetupAtRotation told = fitted->at(reading->notch_rad);
    const Vector3d target_C(0.0, 0.0, 90.0);
    trial.target_mm = (told.X_SC * target_C - truth.X_SC * target_C).norm();
    trial.principal_px = (told.principal_px - Vector2d(truth.lens.cx, truth.lens.cy)).norm();
  }
  return trial;
}

void scopes(std::uint64_t seed, int trials, GoalReport& report) {
  std::vector<double> turns, target, principal;
  double nees = 0.0;
  for (int i = 0; i < trials; ++i) {
    const ScopeTrial trial = scope_trial(seed + static_cast<std::uint64_t>(i));
    turns.insert(turns.end(), trial.turns_deg.begin(), trial.turns_deg.end());
    target.push_back(trial.target_mm), principal.push_back(trial.principal_px);
    nees += trial.nees / trials;
  }
  report.at_most("scope's rotation, degrees, 95 %", 0.5, percentile(turns, 0.95));
  // Two hundred numbers: 0.8 to 1.2 by chance (95 %), 0.7 to 1.3 (997 of a thousand).
  report.within("scope's rotation, NEES", 0.7, 1.3, nees);
  report.at_most("a target 90 mm ahead at another turn, mm, 95 %", 1.0, percentile(target, 0.95));
  report.at_most("principal point at another turn, px, 95 %", 2.0, percentile(principal, 0.95));
}

}  // namespace
}  // namespace perimap::test

int main(int argc, char** argv) {
  CLI::App app("Set-ups drawn at random, measured: errors and whether the deviations are right");
  int trials = 50;
  std::uint64_t seed = 1;
  std::size_t views = 60;
  std::vector<std::string> chosen;
  app.add_option("WHAT", chosen, "hand-eye, slow, camera, tool, tracker, scope; all but slow when none is named");
  app.add_option("--trials", trials)->capture_default_str();
  app.add_option("--seed", seed)->capture_default_str();
  app.add_option("--views", views, "Of the board, for camera")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const auto wants = [&](const char* what) {
    return chosen.empty() ? std::string(what) != "slow" : std::find(chosen.begin(), chosen.end(), what) != chosen.end();
  };
  perimap::test::GoalReport report;
  if (wants("tool")) perimap::test::tools(seed, trials, report);
  if (wants("tracker")) perimap::test::trackers(seed, trials, report);
  if (wants("hand-eye")) perimap::test::hand_eyes(seed, trials, 0.0, report);
  if (wants("slow")) perimap::test::hand_eyes(seed, trials, 0.3, report);
  if (wants("scope")) perimap::test::scopes(seed, trials, report);
  if (wants("camera")) perimap::test::cameras(seed, trials, views, report);
  return report.failed() == 0 ? 0 : 1;
}
