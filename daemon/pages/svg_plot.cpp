#include "daemon/pages/svg_plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "daemon/pages/html_page.hpp"

namespace perimap {
namespace {

constexpr double kMarginLeft = 62.0;
constexpr double kMarginRight = 16.0;
constexpr double kMarginTop = 34.0;
constexpr double kMarginBottom = 46.0;
constexpr double kLegendRow = 17.0;
constexpr double kPlotWidth = 560.0;
constexpr double kPlotHeight = 480.0;
constexpr double kTitleHeight = 34.0;

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void include(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  [[nodiscard]] double length() const { return high - low; }
};

// Room around the data; [0, 1] where there is none.
Range padded(Range range) {
  if (!(range.low <= range.high)) return {0.0, 1.0};
  const double pad = range.length() > 0.0 ? 0.05 * range.length() : 0.5;
  return {range.low - pad, range.high + pad};
}

// 1, 2 or 5 times a power of ten, so that about five fit.
double tick_step(double length) {
  const double raw = length / 5.0;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10.0 * power;
}

// The values where grid lines stand: whole multiples of the step. None where the step is lost in the values' rounding
// (a range of 1e-12 about 1e9).
std::vector<double> ticks(const Range& range) {
  const double step = tick_step(range.length());
  const double first = std::ceil(range.low / step);
  const double count = std::floor(range.high / step) - first + 1.0;
  std::vector<double> values;
  if (!(std::abs(first) < 1e12 && count <= 20.0)) return values;
  for (int k = 0; k < static_cast<int>(count); ++k) values.push_back((first + k) * step);
  return values;
}

std::string text_at(double x, double y, const char* anchor, const std::string& text, const char* more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     escaped(text));
}

}  // namespace

std::string plot_group(const Plot& plot, double x_px, double y_px, double width_px, double height_px) {
  Range x;
  Range y;
  for (const PlotLine& line : plot.lines) {
    for (const PlotPoint& p : line.points) {
      if (!std::isfinite(p.x) || !std::isfinite(p.y)) continue;
      x.include(p.x);
      y.include(p.y);
    }
  }
  x = plot.x_range ? Range{plot.x_range->first, plot.x_range->second} : padded(x);
  y = padded(y);
  if (plot.y_from_zero) y.low = 0.0;
  const double inner_width = width_px - kMarginLeft - kMarginRight;
  const auto labels =
      std::count_if(plot.lines.begin(), plot.lines.end(), [](const PlotLine& line) { return !line.label.empty(); });
  // The legend stands below the axes, two labels a row, where it covers no curve.
  const double inner_height =
      height_px - kMarginTop - kMarginBottom - kLegendRow * std::ceil(static_cast<double>(labels) / 2);
  if (plot.equal_aspect) {
    const double unit = std::max(x.length() / inner_width, y.length() / inner_height);
    const auto widen = [](Range& r, double length) {
      const double middle = 0.5 * (r.low + r.high);
      r = {middle - 0.5 * length, middle + 0.5 * length};
    };
    widen(x, unit * inner_width);
    widen(y, unit * inner_height);
  }
  const auto px = [&](double v) { return kMarginLeft + (v - x.low) / x.length() * inner_width; };
  const auto py = [&](double v) { return kMarginTop + (y.high - v) / y.length() * inner_height; };

  std::string out = fmt::format("<g transform=\"translate({:.1f},{:.1f})\">\n", x_px, y_px);
  out += text_at(width_px / 2, 20, "middle", plot.title, " font-weight=\"bold\"");
  for (const double v : ticks(x)) {
    out += fmt::format("<path d=\"M{0:.1f} {1:.1f}V{2:.1f}\" stroke=\"#e3e3e3\"/>\n", px(v), kMarginTop,
                       kMarginTop + inner_height);
    out += text_at(px(v), kMarginTop + inner_height + 16, "middle", fmt::format("{:g}", v));
  }
  for (const double v : ticks(y)) {
    out += fmt::format("<path d=\"M{0:.1f} {1:.1f}H{2:.1f}\" stroke=\"#e3e3e3\"/>\n", kMarginLeft, py(v),
                       kMarginLeft + inner_width);
    out += text_at(kMarginLeft - 6, py(v) + 4, "end", fmt::format("{:g}", v));
  }
  out += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" stroke=\"#555\"/>\n",
      kMarginLeft, kMarginTop, inner_width, inner_height);
  const double axis_y = kMarginTop + inner_height + 36;
  out += text_at(kMarginLeft + inner_width / 2, axis_y, "middle", plot.x_label);
  out += fmt::format("<text transform=\"translate(16,{:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                     kMarginTop + inner_height / 2, escaped(plot.y_label));

  int labelled = 0;
  for (const PlotLine& line : plot.lines) {
    std::string path;
    bool drawing = false;
    for (const PlotPoint& p : line.points) {
      if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
        drawing = false;
        continue;
      }
      path += fmt::format("{}{:.2f} {:.2f}", drawing ? "L" : "M", px(p.x), py(p.y));
      drawing = true;
    }
    if (!path.empty()) {
      out += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.2f}\"/>\n", path,
                         escaped(line.color), line.width_px);
    }
    if (line.label.empty()) continue;
    const int legend_column = labelled % 2, legend_row = labelled / 2;
    const double x_legend = kMarginLeft + legend_column * inner_width / 2;
    const double y_legend = axis_y + kLegendRow * (1 + legend_row);
    out += fmt::format("<path d=\"M{:.1f} {:.1f}h22\" stroke=\"{}\" stroke-width=\"3\"/>\n", x_legend, y_legend - 4,
                       escaped(line.color));
    out += text_at(x_legend + 28, y_legend, "start", line.label);
    ++labelled;
  }
  return out + "</g>\n";
}

std::string svg_document(const std::vector<Plot>& plots, const std::string& title) {
  const double width = kPlotWidth * static_cast<double>(std::max<std::size_t>(plots.size(), 1));
  const double height = kTitleHeight + kPlotHeight;
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      width, height);
  out += text_at(width / 2, 24, "middle", title, " font-size=\"16\"");
  double x = 0.0;
  for (const Plot& plot : plots) {
    out += plot_group(plot, x, kTitleHeight, kPlotWidth, kPlotHeight);
    x += kPlotWidth;
  }
  return out + "</svg>\n";
}

}  // namespace perimap
