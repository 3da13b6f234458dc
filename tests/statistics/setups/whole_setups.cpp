// Set-ups whose every part is measured, each with what was measured before it, as a user does in the first hour.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "core/angle/angle.hpp"
#include "core/calibration/landmark_registration.hpp"
#include "core/calibration/pivot.hpp"
#include "daemon/setup/camera_calibration.hpp"
#include "daemon/setup/hand_eye.hpp"
#include "daemon/setup/lens_in_hand_eye.hpp"
#include "daemon/setup/recorded_board.hpp"
#include "drawn_setup.hpp"
#include "setups.hpp"

namespace perimap::test {
namespace {

constexpr double kCorner_px = 0.3;
constexpr double kTouched_mm = 0.5;  // RMS of the 3-D norm by which a hand misses a landmark
constexpr double kTracker_s = 1.0 / 60.0;

struct TrueSetup {
  CameraModel camera;
  Pose X_SC;
  Pose X_IW;
  Vector3d tip_T;
  double offset_s = 0.0;
};

struct MeasuredSetup {
  CameraModel camera;
  Pose X_SC;
  Pose X_IW;
  double offset_s = 0.0;
};

TrueSetup drawn_setup(Draw& draw) {
  TrueSetup setup;
  setup.camera = drawn_camera(draw);
  setup.X_SC = {so3_exp(draw.vector(0.8)), Vector3d(0.0, 0.0, 200.0) + draw.vector(40.0)};
  setup.X_IW = {so3_exp(draw.vector(0.8)), draw.vector(300.0)};
  setup.tip_T = Vector3d(0.0, 0.0, draw.uniform(80.0, 250.0)) + draw.vector(10.0);
  setup.offset_s = draw.uniform(-0.5, 0.5);
  return setup;
}

// What is recorded in 40 s: a ChArUco board of 12x9 squares of 8 mm, seen 15 times a second, and the sensor.
struct BoardRecording {
  std::vector<TimedView> views;
  std::vector<TimedPose> sensor;
};

BoardRecording record_board(Draw& draw, const TrueSetup& setup) {
  constexpr double kDuration_s = 40.0;
  const auto board = chessboard(11, 8, 8.0);
  const Vector3d middle(40.0, 28.0, 0.0);
  const Pose X_WB{so3_exp(draw.vector(1.0)), draw.vector(300.0)};
  const HandMotion motion(draw, 40.0, 50.0);
  // The camera looks at the board from 110 mm, and is swung about the board's middle and moved aside.
  const auto X_BC_at = [&](double t_s) {
    const Vector6d m = motion.at(t_s);
    const Pose look{so3_exp(Vector3d(std::numbers::pi, 0.0, 0.0)), middle + Vector3d(0.0, 0.0, 110.0)};
    return Pose{so3_exp(m.head<3>()), middle + m.tail<3>()} * Pose{Matrix3d::Identity(), -middle} * look;
  };
  BoardRecording recording;
  for (double t = 0.0; t < kDuration_s; t += 1.0 / 15.0) {
    if (draw.chance(0.1)) continue;  // the board is not found
    TimedView seen{t, {}};
    seen.view.name = fmt::format("{:.3f} s", t);
    const Pose X_CB = X_BC_at(t).inverse();
    for (const Vector3d& p_B : board) {
      Vector2d px;
      if (setup.camera.project(X_CB * p_B, px) != ProjectionStatus::kOk || !setup.camera.contains(px)) continue;
      seen.view.board_mm.push_back(p_B);
      seen.view.px.push_back(px + Vector2d(draw.normal(kCorner_px), draw.normal(kCorner_px)));
    }
    if (seen.view.px.size() >= 8) recording.views.push_back(std::move(seen));
  }
  TrackerError error(draw, 0.0, kTracker_s);
  for (double t = -1.0; t < kDuration_s + 1.0; t += kTracker_s) {
    recording.sensor.push_back({t - setup.offset_s, error.of(X_WB * X_BC_at(t) * setup.X_SC.inverse())});
  }
  return recording;
}

// The pointer's tip by 20 s of swings, then six landmarks about the organ, each touched for two seconds.
Expected<Pose> registered(Draw& draw, const TrueSetup& setup, const Vector3d& organ_W) {
  TrackerError error(draw, 0.0, kTracker_s);
  const HandMotion swings(draw, 0.0, 50.0);
  const Vector3d pivot_W = draw.vector(500.0);
  std::vector<TimedPose> poses;
  for (double t = 0.0; t < 20.0; t += kTracker_s) {
    const Matrix3d R = so3_exp(swings.at(t).head<3>());
    poses.push_back({t, error.of({R, pivot_W - R * setup.tip_T})});
  }
  const auto tool = calibrate_pivot(poses);
  if (!tool) return tl::unexpected(tool.error());
  std::vector<Landmark> landmarks;
  for (int i = 0; i < 6; ++i) {
    const Vector3d p_W =
        organ_W + Vector3d(draw.uniform(-50.0, 50.0), draw.uniform(-50.0, 50.0), draw.uniform(-25.0, 25.0));
    const Vector3d touched_W = p_W + draw.vector(kTouched_mm / std::sqrt(3.0));
    const Matrix3d R = so3_exp(draw.vector(0.5));
    Vector3d sum = Vector3d::Zero();
    constexpr int kPoses = 120;
    for (int k = 0; k < kPoses; ++k) sum += error.of({R, touched_W - R * setup.tip_T}) * tool->tip_T / kPoses;
    landmarks.push_back({fmt::format("{}", i), setup.X_IW * p_W, sum});
  }
  const auto fitted = register_landmarks(landmarks, 10.0);
  if (!fitted) return tl::unexpected(fitted.error());
  return fitted->X_IW;
}

// Where the measured set-up has a target that is seen while the scope sways, the tracker's poses being exact: the point
// next to the rays of all looks.
Vector3d triangulated(const TrueSetup& setup, const MeasuredSetup& measured, const Vector3d& target_W,
                      const std::function<Pose(double)>& X_WS_at) {
  Matrix3d A = Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (double t = 0.0; t < 10.0; t += 0.1) {
    Vector2d px;
    const Pose X_WC = X_WS_at(t) * setup.X_SC;
    if (setup.camera.project(X_WC.inverse() * target_W, px) != ProjectionStatus::kOk) continue;
    if (!setup.camera.contains(px)) continue;
    Vector3d ray_C;
    if (!measured.camera.unproject(px, ray_C)) continue;
    const Pose told = X_WS_at(t + setup.offset_s - measured.offset_s) * measured.X_SC;
    const Vector3d ray = (told.R * ray_C).normalized();
    const Matrix3d across = Matrix3d::Identity() - ray * ray.transpose();
    A += across, b += across * told.t;
  }
  return A.ldlt().solve(b);
}

struct WholeTrial {
  bool refused = true;
  double focal_percent = 99.0, centre_px = 99.0, rotation_deg = 99.0, translation_mm = 99.0, offset_ms = 99.0;
  // Errors of a target: seen once at a distance that is known, seen while the scope sways, and that in the image.
  double once_mm = 99.0, swayed_mm = 99.0, registered_mm = 99.0;
  double lens_nees = 99.0, hand_eye_nees = 99.0, rotation_nees = 99.0, translation_nees = 99.0, offset_nees = 99.0;
  // Of a target in the picture's middle at a distance that is known, beside what is said of it.
  double target_ratio = 99.0;
};

// A target 90 mm ahead, somewhere in the middle four fifths of the picture.
void judge_target(Draw& draw, const TrueSetup& setup, const MeasuredSetup& measured, const Pose& X_WS0,
                  WholeTrial& trial) {
  const HandMotion sway(draw, 60.0, 15.0);
  const auto X_WS_at = [&](double t_s) {
    const Vector6d m = sway.at(t_s);
    // About the organ, 90 mm ahead of the camera.
    const Pose X_WC0 = X_WS0 * setup.X_SC;
    const Pose ahead{Matrix3d::Identity(), Vector3d(0.0, 0.0, 90.0)};
    const Pose swung{so3_exp(m.head<3>()), Vector3d(0.5 * m[3], 0.4 * m[4], 0.2 * m[5])};
    return X_WC0 * ahead * swung * ahead.inverse() * setup.X_SC.inverse();
  };
  const Vector2d px(setup.camera.width * draw.uniform(0.1, 0.9), setup.camera.height * draw.uniform(0.1, 0.9));
  Vector3d ray_C;
  Vector3d told_C;
  if (!setup.camera.unproject(px, ray_C) || !measured.camera.unproject(px, told_C)) return;
  const Vector3d target_C = 90.0 / ray_C.z() * ray_C;
  trial.once_mm = (setup.X_SC * target_C - measured.X_SC * (90.0 / told_C.z() * told_C)).norm();
  const Vector3d target_W = X_WS_at(0.0) * setup.X_SC * target_C;
  const Vector3d told_W = triangulated(setup, measured, target_W, X_WS_at);
  trial.swayed_mm = (told_W - target_W).norm();
  trial.registered_mm = (measured.X_IW * told_W - setup.X_IW * target_W).norm();
}

WholeTrial whole_trial(std::uint64_t seed) {
  Draw draw(seed);
  const TrueSetup setup = drawn_setup(draw);
  const BoardRecording recording = record_board(draw, setup);
  WholeTrial trial;
  const auto failed = [&](const Error& error) {
    fmt::print("seed {}: {}\n", seed, error.message);
    return trial;
  };
  // Two views a second are enough for the lens, as `perimap calibrate camera --from` takes them.
  std::vector<BoardView> views;
  double due_s = 0.0;
  for (const TimedView& seen : recording.views) {
    if (seen.t_s < due_s) continue;
    views.push_back(seen.view);
    due_s = seen.t_s + 0.5 - 1e-3;
  }
  const auto lens = calibrate_camera(views, setup.camera.width, setup.camera.height, {});
  if (!lens) return failed(lens.error());
  MeasuredSetup measured;
  measured.camera = lens->camera;
  auto hand_eye = calibrate_hand_eye(camera_poses_of(recording.views, lens->camera), recording.sensor, {});
  if (!hand_eye) return failed(hand_eye.error());
  add_lens_uncertainty(*hand_eye, recording.views, lens->camera, lens->covariance);
  measured.X_SC = hand_eye->X_SC;
  measured.offset_s = hand_eye->offset_s;
  const Pose X_WS0{so3_exp(draw.vector(1.0)), draw.vector(300.0)};
  const auto X_IW = registered(draw, setup, X_WS0 * setup.X_SC * Vector3d(0.0, 0.0, 90.0));
  if (!X_IW) return failed(X_IW.error());
  measured.X_IW = *X_IW;

  trial.refused = false;
  const CameraModel& truth = setup.camera;
  const Pose off = measured.X_SC.inverse() * setup.X_SC;
  Vector7d e;
  e << so3_log(off.R), off.t, setup.offset_s - measured.offset_s;
  trial.focal_percent =
      100.0 * std::max(std::abs(lens->camera.fx / truth.fx - 1.0), std::abs(lens->camera.fy / truth.fy - 1.0));
  trial.centre_px = std::hypot(lens->camera.cx - truth.cx, lens->camera.cy - truth.cy);
  trial.rotation_deg = e.head<3>().norm() / kDegree;
  trial.translation_mm = e.segment<3>(3).norm();
  trial.offset_ms = 1e3 * std::abs(e[6]);
  trial.lens_nees = lens_nees_of(*lens, truth);
  const HandEyeNees nees = nees_of(e, hand_eye->covariance);
  trial.hand_eye_nees = nees.all, trial.rotation_nees = nees.rotation;
  trial.translation_nees = nees.translation, trial.offset_nees = nees.offset;
  // The middle as the measured lens has it: of a target there the deviation is published.
  Vector3d ray_C;
  if (!truth.unproject({lens->camera.cx, lens->camera.cy}, ray_C)) return trial;
  const Vector3d target_C = 90.0 / ray_C.z() * ray_C;
  const double target_mm = (setup.X_SC * target_C - measured.X_SC * Vector3d(0.0, 0.0, 90.0)).norm();
  trial.target_ratio = std::pow(target_mm / hand_eye->target_deviation_mm(), 2.0);
  judge_target(draw, setup, measured, X_WS0, trial);
  return trial;
}

}  // namespace

void whole_setups(std::uint64_t seed, int trials, GoalReport& report) {
  std::vector<WholeTrial> all;
  for (int i = 0; i < trials; ++i) all.push_back(whole_trial(seed + static_cast<std::uint64_t>(i)));
  const auto at_most = [&](const char* what, double goal, double WholeTrial::*value) {
    std::vector<double> values;
    for (const WholeTrial& trial : all) values.push_back(trial.*value);
    report.at_most(fmt::format("all measured: {}, 95 %", what), goal, percentile(values, 0.95));
  };
  const auto mean = [&](double WholeTrial::*value) {
    MeanOfMeasured measured;
    for (const WholeTrial& trial : all) {
      if (!trial.refused) measured.add(trial.*value);
    }
    return measured.mean();
  };
  at_most("focal length, %", 0.3, &WholeTrial::focal_percent);
  at_most("principal point, px", 2.0, &WholeTrial::centre_px);
  at_most("hand-eye rotation, degrees", 0.3, &WholeTrial::rotation_deg);
  at_most("hand-eye translation, mm", 0.7, &WholeTrial::translation_mm);
  at_most("time offset, ms", 2.0, &WholeTrial::offset_ms);
  at_most("a target at a known distance, mm", 1.0, &WholeTrial::once_mm);
  at_most("a target seen in a sway, mm", 1.0, &WholeTrial::swayed_mm);
  at_most("that target in the image, mm", 1.0, &WholeTrial::registered_mm);
  const auto refused = std::count_if(all.begin(), all.end(), [](const WholeTrial& trial) { return trial.refused; });
  report.at_most("all measured: refused, %", kMostRefused_percent, 100.0 * static_cast<double>(refused) / trials);
  report.within("all measured: lens, NEES/4", 0.8, 1.2, mean(&WholeTrial::lens_nees));
  report.within("all measured: a target's square by its published variance", 0.8, 1.2, mean(&WholeTrial::target_ratio));
  report.within("all measured: hand-eye and time, NEES/7", 0.8, 1.2, mean(&WholeTrial::hand_eye_nees));
  report.shown("  its rotation, NEES/3", "", mean(&WholeTrial::rotation_nees));
  report.shown("  its translation, NEES/3", "", mean(&WholeTrial::translation_nees));
  report.shown("  the offset, NEES", "", mean(&WholeTrial::offset_nees));
}

}  // namespace perimap::test
