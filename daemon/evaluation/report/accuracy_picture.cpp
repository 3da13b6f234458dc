#include "daemon/evaluation/report/accuracy_picture.hpp"

#include "daemon/pages/svg_plot.hpp"

namespace perimap {
namespace {

constexpr const char* kTruthColor = "#9a9a9a";
constexpr const char* kPublishedColor = "#c0392b";
constexpr const char* kMedianColor = "#1f6f8b";
constexpr const char* kP95Color = "#e08e0b";

std::vector<PlotPoint> seen_from_above(const std::vector<Vector3d>& path) {
  std::vector<PlotPoint> points;
  points.reserve(path.size());
  for (const Vector3d& p : path) points.push_back({p.x(), p.z()});
  return points;
}

Plot motion_paths(const AccuracyReport& report) {
  Plot plot;
  plot.title = "Motion paths from above, last second";
  plot.x_label = "x_W (mm)";
  plot.y_label = "z_W (mm)";
  plot.equal_aspect = true;
  bool first = true;
  for (const FeaturePath& path : report.paths) {
    plot.lines.push_back({seen_from_above(path.truth), kTruthColor, 2.5, first ? "truth" : ""});
    plot.lines.push_back({seen_from_above(path.published), kPublishedColor, 1.0, first ? "published" : ""});
    first = false;
  }
  return plot;
}

Plot error_over_time(const AccuracyReport& report) {
  Plot plot;
  plot.title = "Error of converged features at the valid time";
  plot.x_label = "time (s)";
  plot.y_label = "error (mm)";
  plot.y_from_zero = true;
  PlotLine median{{}, kMedianColor, 2.0, "median"};
  PlotLine p95{{}, kP95Color, 2.0, "95th percentile"};
  for (const ErrorSpan& second : report.seconds) {
    if (second.error.count == 0) continue;
    const double t = 0.5 * (second.begin_s + second.end_s);
    median.points.push_back({t, second.error.median_mm});
    p95.points.push_back({t, second.error.p95_mm});
  }
  plot.lines = {p95, median};
  return plot;
}

Plot converged_over_time(const AccuracyReport& report) {
  Plot plot;
  plot.title = "Features in state converged";
  plot.x_label = "time (s)";
  plot.y_label = "features";
  plot.y_from_zero = true;
  PlotLine line;
  for (const ErrorSpan& second : report.seconds) {
    line.points.push_back({0.5 * (second.begin_s + second.end_s), static_cast<double>(second.converged)});
  }
  plot.lines = {line};
  return plot;
}

}  // namespace

std::string to_svg(const AccuracyReport& report, const std::string& title) {
  return svg_document({motion_paths(report), error_over_time(report), converged_over_time(report)}, title);
}

}  // namespace perimap
