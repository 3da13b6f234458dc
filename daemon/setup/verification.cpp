#include "daemon/setup/verification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/calibration/rotation_spread.hpp"

namespace perimap {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

struct Seen {
  double t_s = 0.0;  // on the tracker's clock
  Pose X_WB;
};

double longest_gap_s(const std::vector<TimedPose>& poses) { return std::max(0.1, 3.0 * median_interval_s(poses)); }

// The board in W by each view.
std::vector<Seen> seen_boards(const std::vector<TimedPose>& camera, const std::vector<TimedPose>& sensor,
                              const SetupOnTrial& setup, std::vector<Matrix3d>& turned) {
  std::vector<Seen> seen;
  const double gap_s = longest_gap_s(sensor);
  for (const TimedPose& pose : camera) {
    const double t_s = pose.t_s - setup.time_offset_s;
    const auto at = pose_at(sensor, t_s, gap_s);
    if (!at) continue;
    seen.push_back({t_s, at->X * setup.X_SC * pose.X.inverse()});
    turned.push_back(at->X.R);
  }
  return seen;
}

Vector3d mean_of(const std::vector<Vector3d>& points) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& p : points) sum += p / static_cast<double>(points.size());
  return sum;
}

// A few views are wrong altogether (the board's mirror image, a tracker's slip): what is six times as far off as most.
void leave_out_wrong(std::vector<Seen>& seen, const Vector3d& middle_B) {
  std::vector<double> x[3];
  for (const Seen& s : seen) {
    for (int axis = 0; axis < 3; ++axis) x[axis].push_back((s.X_WB * middle_B)[axis]);
  }
  Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    auto& values = x[axis];
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    middle[axis] = values[values.size() / 2];
  }
  std::vector<double> distances;
  for (const Seen& s : seen) distances.push_back((s.X_WB * middle_B - middle).norm());
  std::vector<double> sorted = distances;
  const auto half = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), half, sorted.end());
  const double limit = 6.0 * *half + 0.1;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (distances[i] <= limit) seen[kept++] = seen[i];
  }
  seen.resize(kept);
}

// The part of the scatter that means over a second keep, by an analysis of variance between and within them.
void judge_board(Verification& result, const std::vector<Seen>& seen, const std::vector<Vector3d>& places,
                 const Vector3d& mean) {
  constexpr double kBlock_s = 1.0;
  double within = 0.0;        // squares about the blocks' own means
  double within_count = 0.0;  // degrees of freedom
  double between = 0.0;       // squares of the blocks' means
  double inverse_sizes = 0.0;
  double blocks = 0.0;
  for (std::size_t begin = 0; begin < seen.size();) {
    std::size_t end = begin;
    while (end < seen.size() && seen[end].t_s < seen[begin].t_s + kBlock_s) ++end;
    const std::vector<Vector3d> block(places.begin() + static_cast<std::ptrdiff_t>(begin),
                                      places.begin() + static_cast<std::ptrdiff_t>(end));
    const Vector3d block_mean = mean_of(block);
    for (const Vector3d& p : block) within += (p - block_mean).squaredNorm();
    within_count += static_cast<double>(block.size() - 1);
    between += (block_mean - mean).squaredNorm();
    inverse_sizes += 1.0 / static_cast<double>(block.size());
    blocks += 1.0;
    begin = end;
  }
  const double noise = within / std::max(1.0, within_count);
  const double of_means = between / std::max(1.0, blocks - 1.0);
  const double lasting = of_means - noise * inverse_sizes / blocks;
  result.error_mm = std::sqrt(std::max(0.0, lasting));
  // A sum of 3 (blocks - 1) squares, of which the error's own part is what is asked.
  const double of_variance = of_means * std::sqrt(2.0 / (3.0 * std::max(1.0, blocks - 1.0)));
  result.error_mm_deviation = of_variance / (2.0 * std::sqrt(std::max(lasting, of_variance)));
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
  leave_out_wrong(seen, middle_B);
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
  judge_board(result, seen, places, mean);
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
  text += fmt::format("  board         {:.2f} mm, deviation {:.2f}: the error that stays while the scope does; {}\n",
                      result.error_mm, result.error_mm_deviation, verdict(result.board_passed()));
  text +=
      fmt::format("                {:.2f} mm RMS of single views, the tracker's noise included\n", result.scatter_mm);
  if (result.touch) {
    const Vector3d& e = result.touch->error_W_mm;
    text += fmt::format(
        "  touched point {:.2f} mm, deviation {:.2f}: pointer less camera ({:.2f} {:.2f} {:.2f}) mm in "
        "the tracker's frame, held for {:.1f} s; {}\n",
        result.touch->error_mm, result.touch->error_mm_deviation, e.x(), e.y(), e.z(), result.touch->held_s,
        verdict(result.touch_passed()));
  } else {
    text += "  touched point none: what is wrong alike from all sides does not show; touch a point with --tip\n";
  }
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

}  // namespace perimap
