// Line plots as SVG text.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace perimap {

struct PlotPoint {
  double x = 0.0;
  double y = 0.0;
};

struct PlotLine {
  std::vector<PlotPoint> points;  // a point that is not finite interrupts the line
  std::string color = "#1f6f8b";  // an SVG colour
  double width_px = 1.5;
  std::string label;  // in the legend; none when empty
};

struct Plot {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<PlotLine> lines;
  bool equal_aspect = false;  // a unit of x is as long as a unit of y
  bool y_from_zero = false;
  std::optional<std::pair<double, double>> x_range =
      std::nullopt;  // what the axis shows; none: the data and a little room
};

// One plot of this size with axes, ticks and legend, as an SVG group whose corner is at (x_px, y_px).
[[nodiscard]] std::string plot_group(const Plot& plot, double x_px, double y_px, double width_px, double height_px);

// Plots side by side in one self-contained SVG document.
[[nodiscard]] std::string svg_document(const std::vector<Plot>& plots, const std::string& title);

}  // namespace perimap
