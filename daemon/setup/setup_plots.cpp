#include "daemon/setup/setup_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/angle/angle.hpp"
#include "daemon/pages/html_page.hpp"

namespace perimap {
namespace {

constexpr double kNoPoint = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kKept = "#1f6f8b";
constexpr const char* kLeftOut = "#c0392b";
constexpr const char* kOther = "#e08e0b";

// A short stroke for each value, so that single ones are seen.
void mark(PlotLine& line, double x, double y, double height) {
  line.points.push_back({x, y - 0.5 * height});
  line.points.push_back({x, y + 0.5 * height});
  line.points.push_back({kNoPoint, kNoPoint});
}

PlotLine line_of(const char* color, const std::string& label, double width_px = 1.5) {
  PlotLine line;
  line.color = color;
  line.label = label;
  line.width_px = width_px;
  return line;
}

Plot plot_of(const std::string& title, const std::string& x, const std::string& y) {
  Plot plot;
  plot.title = title;
  plot.x_label = x;
  plot.y_label = y;
  plot.y_from_zero = true;
  return plot;
}

}  // namespace

std::vector<Plot> plots_of(const HandEyeCalibration& result) {
  Plot place = plot_of("Error of each pose at the sensor", "time, s", "translation, mm");
  Plot turn = plot_of("Error of each pose at the sensor", "time, s", "rotation, degrees");
  for (Plot* plot : {&place, &turn}) {
    PlotLine kept = line_of(kKept, "used");
    PlotLine out = line_of(kLeftOut, "left out");
    double largest = 0.0;
    std::vector<double> values;
    for (const PosePair& pair : result.pairs) {
      const Vector6d e = hand_eye_error(pair, result.X_SC, result.X_WB);
      values.push_back(plot == &place ? e.tail<3>().norm() : e.head<3>().norm() / kDegree);
      largest = std::max(largest, values.back());
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      mark(result.used[i] != 0 ? kept : out, result.pairs[i].t_s - result.pairs.front().t_s, values[i], 0.01 * largest);
    }
    plot->lines = {kept, out};
  }
  Plot shares =
      plot_of("AX - XB over all pairs of poses, and by other solvers", "translation, mm", "share of the pairs");
  std::vector<double> sorted = result.disagreements_mm;
  std::sort(sorted.begin(), sorted.end());
  PlotLine ours = line_of(kKept, "this result");
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    ours.points.push_back({sorted[i], static_cast<double>(i + 1) / static_cast<double>(sorted.size())});
  }
  shares.lines.push_back(ours);
  PlotLine others = line_of(kOther, "medians of OpenCV's");
  for (const OtherHandEye& other : result.others) mark(others, other.residual_median_mm, 0.5, 0.08);
  shares.lines.push_back(others);
  return {place, turn, shares};
}

std::vector<Plot> plots_of(const CameraCalibration& result) {
  // Residuals many times as long as they are, where they are.
  const double longer = std::max(1.0, std::round(0.02 * result.camera.width / std::max(0.05, result.rms_px)));
  Plot where = plot_of(fmt::format("Points and their residuals, {:.0f} times as long", longer), "px", "px, upwards");
  where.equal_aspect = true;
  where.y_from_zero = false;
  const double height = result.camera.height;
  PlotLine frame = line_of("#999", "");
  for (const auto& [x, y] :
       {std::pair(0.0, 0.0), std::pair(1.0, 0.0), std::pair(1.0, 1.0), std::pair(0.0, 1.0), std::pair(0.0, 0.0)}) {
    frame.points.push_back({x * result.camera.width, y * height});
  }
  PlotLine strokes = line_of(kKept, "residual");
  PlotLine centre = line_of(kLeftOut, "principal point", 3.0);
  for (std::size_t v = 0; v < result.points_px.size(); ++v) {
    for (std::size_t i = 0; i < result.points_px[v].size(); ++i) {
      const Vector2d& p = result.points_px[v][i];
      const Vector2d q = p + longer * result.residuals_px[v][i];
      strokes.points.push_back({p.x(), height - p.y()});
      strokes.points.push_back({q.x(), height - q.y()});
      strokes.points.push_back({kNoPoint, kNoPoint});
    }
  }
  mark(centre, result.camera.cx, height - result.camera.cy, 0.05 * height);
  where.lines = {frame, strokes, centre};
  Plot views = plot_of("Each view", "view", "RMS, px");
  PlotLine rms = line_of(kKept, "");
  for (std::size_t v = 0; v < result.views.size(); ++v) {
    if (!result.views[v].used) continue;
    const double x = static_cast<double>(v);
    rms.points.insert(rms.points.end(), {{x, 0.0}, {x, result.views[v].rms_px}, {kNoPoint, kNoPoint}});
  }
  rms.width_px = 3.0;
  views.lines = {rms};
  return {where, views};
}

std::vector<Plot> plots_of(const SignalOffset& result, const std::vector<TimedValue>& first,
                           const std::vector<TimedValue>& second) {
  Plot plot = plot_of("The second signal on the first one's clock and scale", "time, s", "");
  plot.y_from_zero = false;
  const auto mean = [](const std::vector<TimedValue>& signal) {
    double sum = 0.0;
    for (const TimedValue& v : signal) sum += v.value / static_cast<double>(signal.size());
    return sum;
  };
  const double begin_s = first.front().t_s;
  PlotLine one = line_of(kKept, "first");
  PlotLine other = line_of(kOther, "second");
  for (const TimedValue& v : first) one.points.push_back({v.t_s - begin_s, v.value - mean(first)});
  const double constant = mean(second);
  for (const TimedValue& v : second) {
    const double t_s = v.t_s + result.offset_s;
    if (t_s < begin_s || t_s > first.back().t_s) continue;
    other.points.push_back({t_s - begin_s, result.gain * (v.value - constant)});
  }
  plot.lines = {one, other};
  return {plot};
}

std::vector<Plot> plots_of(const PivotCalibration& result, const std::vector<TimedPose>& poses) {
  Plot plot = plot_of("The tip's distance from the point it turned about", "time, s", "mm");
  PlotLine kept = line_of(kKept, "used", 2.5);
  PlotLine out = line_of(kLeftOut, "left out", 2.5);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double distance = (poses[i].X * result.tip_T - result.pivot_W).norm();
    const double t_s = poses[i].t_s - poses.front().t_s;
    auto& line = result.used[i] != 0 ? kept : out;
    line.points.insert(line.points.end(), {{t_s, 0.0}, {t_s, distance}, {kNoPoint, kNoPoint}});
  }
  plot.lines = {kept, out};
  return {plot};
}

std::vector<Plot> plots_of(const MeasuredNoise& result) {
  Plot place = plot_of("Allan deviation of the position", "log10 of the time averaged over, s", "log10 of mm");
  Plot turn = plot_of("Allan deviation of the orientation", "log10 of the time averaged over, s", "log10 of degrees");
  place.y_from_zero = turn.y_from_zero = false;
  PlotLine mm = line_of(kKept, "");
  PlotLine deg = line_of(kKept, "");
  for (const AllanPoint& point : result.allan) {
    if (point.position_mm > 0.0) mm.points.push_back({std::log10(point.averaged_s), std::log10(point.position_mm)});
    if (point.rotation_deg > 0.0) deg.points.push_back({std::log10(point.averaged_s), std::log10(point.rotation_deg)});
  }
  place.lines = {mm};
  turn.lines = {deg};
  return {place, turn};
}

std::vector<Plot> plots_of(const LandmarkRegistration& result) {
  Plot plot = plot_of("Each landmark, in the order of the touches", "landmark", "off by, mm");
  PlotLine fitted = line_of(kKept, "fitted with the others", 4.0);
  PlotLine aside = line_of(kOther, "by the others alone", 4.0);
  for (std::size_t i = 0; i < result.residuals_mm.size(); ++i) {
    const double x = static_cast<double>(i + 1);
    fitted.points.insert(fitted.points.end(), {{x, 0.0}, {x, result.residuals_mm[i]}, {kNoPoint, kNoPoint}});
    if (result.held_aside_mm.empty()) continue;
    aside.points.insert(aside.points.end(),
                        {{x + 0.15, 0.0}, {x + 0.15, result.held_aside_mm[i]}, {kNoPoint, kNoPoint}});
  }
  plot.lines = {fitted, aside};
  return {plot};
}

std::string setup_page(const std::string& title, const std::string& text, const std::vector<Plot>& plots) {
  std::string body = fmt::format("<pre>{}</pre>\n", escaped(text));
  for (const Plot& plot : plots) body += svg_document({plot}, "");
  return html_page(title, body);
}

}  // namespace perimap
