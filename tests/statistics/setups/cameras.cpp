// Lenses.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "daemon/setup/camera_calibration.hpp"
#include "drawn_setup.hpp"
#include "setups.hpp"

namespace perimap::test {
namespace {

// Where in the picture the board is shown, and how.
struct Showing {
  std::string name;
  double distance = 1.0;  // as many times as far away, and so as much smaller
  double right = 1e9;     // no corner beyond this share of the picture's width
  double most_rad = 0.7;  // tilted by no more
  bool judged = true;     // that its deviations are right
};

std::vector<BoardView> shown(Draw& draw, const CameraModel& camera, std::size_t view_count, const Showing& showing) {
  const auto board = chessboard(9, 6, 8.0);
  std::vector<BoardView> views;
  while (views.size() < view_count) {
    const double most = showing.most_rad;
    const Pose X_CB{
        so3_exp(Vector3d(draw.uniform(-most, most), draw.uniform(-most, most), draw.uniform(-1.6, 1.6))),
        Vector3d(draw.uniform(-25.0, 25.0), draw.uniform(-15.0, 15.0), showing.distance * draw.uniform(80.0, 140.0))};
    BoardView view;
    view.name = fmt::format("{}", views.size());
    for (const Vector3d& p_B : board) {
      Vector2d px;
      const Vector3d p_C = X_CB * (p_B - Vector3d(32.0, 20.0, 0.0));
      if (camera.project(p_C, px) != ProjectionStatus::kOk || !camera.contains(px)) break;
      if (px.x() > showing.right * camera.width) break;
      view.board_mm.push_back(p_B);
      view.px.push_back(px + Vector2d(draw.normal(0.3), draw.normal(0.3)));
    }
    if (view.px.size() == board.size()) views.push_back(view);
  }
  return views;
}

// Of fx, fy, cx, cy.
Eigen::Vector4d lens_error(const CameraModel& told, const CameraModel& truth) {
  return {told.fx - truth.fx, told.fy - truth.fy, told.cx - truth.cx, told.cy - truth.cy};
}

struct CameraTrial {
  bool refused = true;
  double focal_percent = 99.0;
  double centre_px = 99.0;
  double nees = 99.0;
  double focal_deviation_percent = 99.0;
  double centre_deviation_px = 99.0;
};

CameraTrial camera_trial(std::uint64_t seed, std::size_t view_count, const Showing& showing, std::string& refusal) {
  Draw draw(seed);
  const CameraModel camera = drawn_camera(draw);
  const auto result = calibrate_camera(shown(draw, camera, view_count, showing), camera.width, camera.height, {});
  if (!result) {
    refusal = result.error().message;
    return {};
  }
  const CameraModel& c = result->camera;
  const Eigen::Vector4d e = lens_error(c, camera);
  CameraTrial trial;
  trial.refused = false;
  trial.focal_percent = 100.0 * std::max(std::abs(e[0]) / camera.fx, std::abs(e[1]) / camera.fy);
  trial.centre_px = e.tail<2>().norm();
  trial.nees = lens_nees_of(*result, camera);
  trial.focal_deviation_percent = 100.0 * std::max(result->deviations[0] / c.fx, result->deviations[1] / c.fy);
  trial.centre_deviation_px = std::hypot(result->deviations[2], result->deviations[3]);
  return trial;
}

}  // namespace

double lens_nees_of(const CameraCalibration& result, const CameraModel& truth) {
  const Eigen::Vector4d e = lens_error(result.camera, truth);
  const Eigen::Matrix4d C = result.covariance.topLeftCorner<4, 4>();
  return e.dot(C.ldlt().solve(e)) / 4.0;
}

void cameras(std::uint64_t seed, int trials, std::size_t view_count, GoalReport& report) {
  std::vector<double> focal, centre;
  MeanOfMeasured nees;
  for (int i = 0; i < trials; ++i) {
    std::string refusal;
    const CameraTrial trial = camera_trial(seed + static_cast<std::uint64_t>(i), view_count, {}, refusal);
    if (trial.refused) fmt::print("seed {}: {}\n", i, refusal);
    focal.push_back(trial.focal_percent), centre.push_back(trial.centre_px);
    if (!trial.refused) nees.add(trial.nees);
  }
  const std::string by = fmt::format(", {} views", view_count);
  report.at_most("focal length, %, 95 %" + by, 0.3, percentile(focal, 0.95));
  report.at_most("principal point, px, 95 %" + by, 2.0, percentile(centre, 0.95));
  report.at_most("lenses refused, %" + by, kMostRefused_percent, nees.refused_percent(trials));
  report.within("focal lengths and principal point, NEES/4" + by, 0.8, 1.2, nees.mean());
}

void few_views(std::uint64_t seed, int trials, GoalReport& report) {
  const Showing showings[] = {{"all over the picture"},
                              {"in its middle, half as large", 2.0},
                              {"in its middle, a third as large", 3.5, 1e9, 0.7, false},
                              {"in its left half", 1.5, 0.55},
                              {"tilted by 15 degrees at most", 1.0, 1e9, 0.25}};
  for (const Showing& showing : showings) {
    GoalReport::heading("board " + showing.name, {"refused", "focal %", "said %", "point px", "said px", "NEES/4"});
    double sum = 0.0, count = 0.0;
    for (const std::size_t views : {7, 8, 10, 12, 15, 20, 30}) {
      std::vector<double> focal, centre, focal_said, centre_said, nees;
      for (int i = 0; i < trials; ++i) {
        std::string refusal;
        const CameraTrial trial = camera_trial(seed + static_cast<std::uint64_t>(i), views, showing, refusal);
        if (trial.refused) continue;
        focal.push_back(trial.focal_percent), centre.push_back(trial.centre_px), nees.push_back(trial.nees);
        focal_said.push_back(trial.focal_deviation_percent), centre_said.push_back(trial.centre_deviation_px);
      }
      if (nees.empty()) {
        GoalReport::line_of(fmt::format("  {} views", views), {1.0 * trials});
        continue;
      }
      double mean = 0.0;
      for (const double n : nees) mean += n / static_cast<double>(nees.size()), sum += n, count += 1.0;
      GoalReport::line_of(fmt::format("  {} views", views),
                          {trials - static_cast<double>(nees.size()), percentile(focal, 0.95),
                           percentile(focal_said, 0.5), percentile(centre, 0.95), percentile(centre_said, 0.5), mean});
    }
    const char* all = "  NEES/4 of all that were not refused";
    if (showing.judged) {
      report.within(all, 0.8, 1.2, sum / std::max(1.0, count));
    } else {
      report.shown(all, "", sum / std::max(1.0, count));
    }
  }
}

}  // namespace perimap::test
