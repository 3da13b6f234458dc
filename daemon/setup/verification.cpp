#include "daemon/setup/verification.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "core/angle/angle.hpp"
#include "core/calibration/rotation_spread.hpp"
#include "core/statistics/upper_median.hpp"
#include "daemon/setup/clock_on_trial.hpp"

namespace perimap {
namespace {

struct Seen {
  TimedPose view;
  double t_s = 0.0;  // on the tracker's clock
  Pose X_WB;
  double kept = 1.0;  // share of the variance of one of the tracker's poses that is left between two
};

// Between poses s of the way from one to the next.
double kept_between(const std::vector<TimedPose>& sensor, double t_s) {
  const auto next =
      std::lower_bound(sensor.begin(), sensor.end(), t_s, [](const TimedPose& pose, double t) { return pose.t_s < t; });
  if (next == sensor.begin() || next == sensor.end()) return 1.0;
  const double s = (t_s - std::prev(next)->t_s) / (next->t_s - std::prev(next)->t_s);
  return s * s + (1.0 - s) * (1.0 - s);
}

// The board in W by each view.
std::vector<Seen> seen_boards(const std::vector<TimedPose>& camera, const std::vector<TimedPose>& sensor,
                              const SetupOnTrial& setup, std::vector<Matrix3d>& turned) {
  std::vector<Seen> seen;
  const double gap_s = longest_gap_s(sensor);
  for (const TimedPose& pose : camera) {
    const double t_s = pose.t_s - setup.time_offset_s;
    const auto at = pose_at(sensor, t_s, gap_s);
    if (!at) continue;
    seen.push_back({pose, t_s, at->X * setup.X_SC * pose.X.inverse(), kept_between(sensor, t_s)});
    turned.push_back(at->X.R);
  }
  return seen;
}

Vector3d mean_of(const std::vector<Vector3d>& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : points) sum += p / static_cast<double>(points.size());
  return sum;
}

// A few views are wrong altogether (the board's mirror image): what is six times as far off as most, here and there.
// Where they are more than a few, or one after the other, it is the set-up that moved, and they count like all others.
std::size_t leave_out_wrong(std::vector<Seen>& seen, const Vector3d& middle_B) {
  std::vector<double> x[3];
  for (const Seen& s : seen) {
    for (int axis = 0; axis < 3; ++axis) x[axis].push_back((s.X_WB * middle_B)[axis]);
  }
  Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) middle[axis] = upper_median(x[axis].begin(), x[axis].end());
  std::vector<double> distances;
  for (const Seen& s : seen) distances.push_back((s.X_WB * middle_B - middle).norm());
  std::vector<double> sorted = distances;
  const double limit = 6.0 * upper_median(sorted.begin(), sorted.end()) + 0.1;
  std::size_t wrong = 0;
  std::size_t run = 0;
  std::size_t longest_run = 0;
  for (const double distance : distances) {
    run = distance > limit ? run + 1 : 0;
    wrong += distance > limit ? 1 : 0;
    longest_run = std::max(longest_run, run);
  }
  constexpr double kMostShare = 0.03;
  constexpr std::size_t kLongestRun = 2;
  if (wrong == 0 || longest_run > kLongestRun ||
      static_cast<double>(wrong) > kMostShare * static_cast<double>(seen.size())) {
    return 0;
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (distances[i] <= limit) seen[kept++] = seen[i];
  }
  seen.resize(kept);
  return wrong;
}

// Variance of the 3-D position of a point of the sensor's, mm^2, that is new in each of the tracker's poses: by second
// differences, in which a hand's motion hardly shows at a tracker's rate.
double noise_variance(const std::vector<TimedPose>& sensor, const Vector3d& point_S) {
  const double gap_s = 2.5 * median_interval_s(sensor);
  std::vector<double> squares;
  for (std::size_t i = 1; i + 1 < sensor.size(); ++i) {
    if (sensor[i + 1].t_s - sensor[i - 1].t_s > gap_s) continue;
    const Vector3d between = 0.5 * (sensor[i - 1].X * point_S + sensor[i + 1].X * point_S);
    squares.push_back((sensor[i].X * point_S - between).squaredNorm());
  }
  if (squares.empty()) return 0.0;
  // Of 1.5 variances; the median of a chi-squared of three degrees of freedom is 2.366 of its 3.
  return upper_median(squares.begin(), squares.end()) / 1.5 * 3.0 / 2.366;
}

// What is left of the scatter when the tracker's own new noise is taken off: every error that stays, or goes with the
// pose or the speed. Its deviation is that of the means over a second.
void judge_board(Verification& result, const std::vector<Seen>& seen, const std::vector<Vector3d>& places,
                 const Vector3d& mean, double noise_of_pose) {
  constexpr double kBlock_s = 1.0;
  double noise = 0.0;
  for (const Seen& s : seen) noise += s.kept * noise_of_pose / static_cast<double>(seen.size());
  std::vector<double> blocks;
  double all = 0.0;
  for (std::size_t begin = 0; begin < seen.size();) {
    std::size_t end = begin;
    double squares = 0.0;
    while (end < seen.size() && seen[end].t_s < seen[begin].t_s + kBlock_s) {
      squares += (places[end] - mean).squaredNorm();
      ++end;
    }
    all += squares;
    blocks.push_back(squares / static_cast<double>(end - begin));
    begin = end;
  }
  const double square = all / static_cast<double>(std::max<std::size_t>(2, seen.size()) - 1);
  double spread = 0.0;
  for (const double block : blocks) spread += (block - square) * (block - square);
  const auto count = static_cast<double>(blocks.size());
  const double of_square = std::sqrt(spread / std::max(1.0, count - 1.0) / count);
  const double left = square - noise;
  result.error_mm = std::sqrt(std::max(0.0, left));
  result.error_mm_deviation = of_square / (2.0 * std::sqrt(std::max(left, of_square + 1e-12)));
}

// A displacement d of the camera in S puts the board at R_WS d, and its mean over the views is not known for an error.
double unseen_displacement(const Verification& result, const std::vector<Matrix3d>& turned) {
  if (!result.board_passed()) return 0.0;
  Matrix3d mean = Matrix3d::Zero();
  for (const Matrix3d& R : turned) mean += R / static_cast<double>(turned.size());
  const Eigen::SelfAdjointEigenSolver<Matrix3d> kept(mean.transpose() * mean);
  const double shown_share = std::sqrt(std::max(1e-6, 1.0 - kept.eigenvalues().maxCoeff()));
  const double room = result.bound_mm - 2.0 * result.error_mm_deviation;
  return std::sqrt(std::max(0.0, room * room - result.error_mm * result.error_mm)) / shown_share;
}

// Fails where nothing tells.
Expected<void> judge_clocks(Verification& result, const std::vector<Seen>& seen, const std::vector<TimedPose>& sensor,
                            const SetupOnTrial& setup) {
  std::vector<TimedPose> views;
  for (const Seen& s : seen) views.push_back(s.view);
  const auto clocks = clock_error(views, sensor, setup.X_SC, setup.time_offset_s);
  if (!clocks) {
    return fail(
        "the tracker's poses around the views are too few to tell how fast the scope was, and so whether the time "
        "offset is right: keep the sensor in sight, and look for longer");
  }
  result.clock_error_ms = 1e3 * clocks->change_s;
  result.clock_error_ms_deviation = 1e3 * clocks->deviation_s;
  return {};
}

// The stretch that was held nearest to where the camera has the point.
Expected<VerifiedTouch> judge_touch(const TouchOnTrial& touch, const std::vector<Seen>& seen) {
  constexpr double kShortest_s = 1.5;
  constexpr double kRadius_mm = 5.0;
  constexpr double kAnother_mm = 40.0;  // further off it is no error but another point
  std::vector<Vector3d> places;
  for (const Seen& s : seen) places.push_back(s.X_WB * touch.touched_B);
  const Vector3d by_camera = mean_of(places);
  const auto dwells = find_dwells(touch.tip_W, kShortest_s, kRadius_mm);
  if (dwells.empty()) {
    return fail("the pointer's tip was held still nowhere: rest it on the board's point for two seconds and more");
  }
  const auto nearest = std::min_element(dwells.begin(), dwells.end(), [&](const Dwell& a, const Dwell& b) {
    return (a.p - by_camera).norm() < (b.p - by_camera).norm();
  });
  VerifiedTouch result;
  result.error_W_mm = nearest->p - by_camera;
  result.error_mm = result.error_W_mm.norm();
  result.held_s = nearest->end_s - nearest->begin_s;
  if (result.error_mm > kAnother_mm) {
    return fail(
        fmt::format("the pointer's tip was held still {:.0f} mm from the board's point ({:g}, {:g}) mm, and no "
                    "nearer: touch that point, or say with --touched which one it was",
                    result.error_mm, touch.touched_B.x(), touch.touched_B.y()));
  }
  double squares = 0.0;
  for (const Vector3d& p : places) squares += (p - by_camera).squaredNorm();
  const auto n = static_cast<double>(places.size());
  result.error_mm_deviation =
      std::sqrt((squares / std::max(1.0, n - 1.0) / n + touch.tip_deviation_mm * touch.tip_deviation_mm +
                 nearest->deviation_mm * nearest->deviation_mm) /
                3.0);
  return result;
}

}  // namespace

Expected<Verification> verify_setup(const std::vector<TimedPose>& camera, const std::vector<TimedPose>& sensor,
                                    const Vector3d& middle_B, const SetupOnTrial& setup,
                                    const std::optional<TouchOnTrial>& touch, double bound_mm) {
  constexpr std::size_t kFewestViews = 20;
  constexpr double kShortest_s = 5.0;
  constexpr double kLeastTurn_deg = 4.0;
  Verification result;
  result.bound_mm = bound_mm;
  std::vector<Matrix3d> turned;
  std::vector<Seen> seen = seen_boards(camera, sensor, setup, turned);
  if (seen.size() < kFewestViews || seen.back().t_s - seen.front().t_s < kShortest_s) {
    return fail(
        fmt::format("the board is seen while the tracker has the scope at {} times only, and {} over {:g} s are "
                    "needed: keep board and sensor in sight, and look for longer",
                    seen.size(), kFewestViews, kShortest_s));
  }
  result.turned_deg = rotation_spread(turned).deviation_rad / kDegree;
  if (result.turned_deg[1] < kLeastTurn_deg) {
    return fail(
        fmt::format("the scope was turned by {:.1f}, {:.1f} and {:.1f} degrees only (standard deviations about "
                    "three axes), which hides a wrong set-up: swing it about the board to all sides",
                    result.turned_deg[0], result.turned_deg[1], result.turned_deg[2]));
  }
  result.views_left_out = leave_out_wrong(seen, middle_B);
  result.views = seen.size();
  result.watched_s = seen.back().t_s - seen.front().t_s;
  std::vector<Vector3d> places;
  for (const Seen& s : seen) places.push_back(s.X_WB * middle_B);
  const Vector3d mean = mean_of(places);
  double squares = 0.0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    result.times_s.push_back(seen[i].t_s - seen.front().t_s);
    result.errors_mm.push_back((places[i] - mean).norm());
    squares += (places[i] - mean).squaredNorm();
  }
  result.scatter_mm = std::sqrt(squares / static_cast<double>(seen.size() - 1));
  // The board's middle as the sensor has it at the first view: how far out a turn of the sensor is felt.
  const Vector3d middle_S = setup.X_SC * (camera.front().X.inverse() * middle_B);
  judge_board(result, seen, places, mean, noise_variance(sensor, middle_S));
  result.unseen_mm = unseen_displacement(result, turned);
  if (auto judged = judge_clocks(result, seen, sensor, setup); !judged) {
    return tl::unexpected(judged.error());
  }
  if (touch) {
    const auto judged = judge_touch(*touch, seen);
    if (!judged) return tl::unexpected(judged.error());
    result.touch = *judged;
  }
  return result;
}

std::string text_of(const Verification& result) {
  const auto verdict = [](bool passed) { return passed ? "passed" : "FAILED"; };
  std::string text = fmt::format("Set-up on the spot, at 0 ms, by {} views over {:.0f} s: {} (bound {:g} mm)\n",
                                 result.views, result.watched_s, verdict(result.passed()), result.bound_mm);
  text += fmt::format(
      "  board         {:.2f} mm, deviation {:.2f}: the error of where the board is seen, the tracker's noise of each "
      "pose taken off; {}\n",
      result.error_mm, result.error_mm_deviation, verdict(result.board_passed()));
  text +=
      fmt::format("                {:.2f} mm RMS of single views, the tracker's noise included\n", result.scatter_mm);
  text += fmt::format(
      "  clocks        {:.1f} ms, deviation {:.1f}: to be added to the time offset; {:.1f} mm for a scope that moves "
      "at "
      "{:g} mm/s; {}\n",
      result.clock_error_ms, result.clock_error_ms_deviation,
      1e-3 * std::abs(result.clock_error_ms) * Verification::kBrisk_mm_per_s, Verification::kBrisk_mm_per_s,
      verdict(result.clock_passed()));
  if (result.touch) {
    const Vector3d& e = result.touch->error_W_mm;
    text += fmt::format(
        "  touched point {:.2f} mm, deviation {:.2f}: pointer less camera ({:.2f} {:.2f} {:.2f}) mm in "
        "the tracker's frame, held for {:.1f} s; {}\n",
        result.touch->error_mm, result.touch->error_mm_deviation, e.x(), e.y(), e.z(), result.touch->held_s,
        verdict(result.touch_passed()));
  } else {
    text += "  touched point none: what is wrong alike from all sides does not show";
    if (result.unseen_mm > 0.0) {
      text += fmt::format(", and a hand-eye that is up to {:.1f} mm off passes too by this swing", result.unseen_mm);
    }
    text +=
        "; rest the tip of a calibrated pointer on a point of the board and say --tip, or turn the scope further about "
        "all axes\n";
  }
  if (result.views_left_out > 0)
    text += fmt::format("  left out      {} views that are far off\n", result.views_left_out);
  text += fmt::format("  turned        {:.1f} {:.1f} {:.1f} degrees (standard deviation about three axes)\n",
                      result.turned_deg[0], result.turned_deg[1], result.turned_deg[2]);
  return text;
}

std::vector<Plot> plots_of(const Verification& result) {
  Plot plot;
  plot.title = "The board's middle by each view, from its mean";
  plot.x_label = "time, s";
  plot.y_label = "mm";
  plot.y_from_zero = true;
  PlotLine views;
  views.width_px = 2.0;
  constexpr double kNoPoint = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < result.times_s.size(); ++i) {
    views.points.insert(views.points.end(),
                        {{result.times_s[i], 0.0}, {result.times_s[i], result.errors_mm[i]}, {kNoPoint, kNoPoint}});
  }
  PlotLine bound;
  bound.color = "#c0392b";
  bound.label = "bound";
  bound.points = {{0.0, result.bound_mm}, {result.watched_s, result.bound_mm}};
  plot.lines = {views, bound};
  return {plot};
}

nlohmann::json json_of(const Verification& result) {
  nlohmann::json json = {{"passed", result.passed()},
                         {"bound_mm", result.bound_mm},
                         {"latency_ms", 0},
                         {"board_error_mm", result.error_mm},
                         {"board_error_mm_deviation", result.error_mm_deviation},
                         {"clock_error_ms", result.clock_error_ms},
                         {"clock_error_ms_deviation", result.clock_error_ms_deviation},
                         {"scatter_mm", result.scatter_mm},
                         {"views", result.views},
                         {"views_left_out", result.views_left_out},
                         {"watched_s", result.watched_s},
                         {"unseen_mm", nullptr},
                         {"touch_error_mm", nullptr},
                         {"touch_error_mm_deviation", nullptr}};
  if (result.touch) {
    json["touch_error_mm"] = result.touch->error_mm;
    json["touch_error_mm_deviation"] = result.touch->error_mm_deviation;
    const Vector3d& e = result.touch->error_W_mm;
    json["touch_error_W_mm"] = {e.x(), e.y(), e.z()};
  }
  if (!result.touch && result.board_passed()) json["unseen_mm"] = result.unseen_mm;
  return json;
}

std::string advice_of(const Verification& result) {
  if (!result.clock_passed()) {
    constexpr double kUnknown = 2.0;  // deviations within which it may as well be right
    if (std::abs(result.clock_error_ms) < kUnknown * result.clock_error_ms_deviation) {
      return "the scope was swung too slowly to tell whether the time offset is right: swing it briskly, and for "
             "longer";
    }
    return fmt::format(
        "the clocks of camera and tracker are {:.1f} ms off: measure the time offset anew (perimap calibrate time)",
        result.clock_error_ms);
  }
  if (!result.board_passed()) {
    return "the board wanders as the scope moves: measure lens, hand-eye and time offset anew (perimap calibrate), and "
           "look whether the sensor is loose on the scope";
  }
  return "camera and pointer disagree: measure the pointer's tip and the hand-eye anew (perimap calibrate), and look "
         "whether the point touched is the one named";
}

}  // namespace perimap
