#include "daemon/evaluation/experiment/experiment_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/evaluation/json/json_number.hpp"
#include "daemon/pages/html_page.hpp"

namespace perimap {
namespace {

// Three digits or so; large values without fractions.
std::string figure(double value) {
  if (std::isnan(value)) return "-";
  if (std::isinf(value)) return "none";
  if (std::abs(value) >= 1e5) return fmt::format("{:.1e}", value);
  return fmt::format("{:.{}f}", value, std::abs(value) < 10.0 ? 3 : std::abs(value) < 100.0 ? 1 : 0);
}

std::string share(double value) { return fmt::format("{:.1f} %", 100.0 * value); }

std::string csv_text(const std::string& text) { return '"' + text + '"'; }

}  // namespace

std::string to_table(const Experiment& experiment) {
  std::string out = fmt::format("{}\n{}\n{} trials, seed {}\n\n", experiment.title, experiment.setting,
                                experiment.trials, experiment.seed);
  out += fmt::format("{:<24}{:>9}{:>11}{:>9}{:>11}{:>9}{:>11}{:>11}\n", "path error (mm)", "features", "median", "95 %",
                     "worst", "> 2 mm", "NEES/3", "us/update");
  for (const MethodRow& row : experiment.rows) {
    out += fmt::format("{:<24}{:>9}{:>11}{:>9}{:>11}{:>9}{:>11}{:>11}\n", row.method, row.features,
                       figure(row.median_mm), figure(row.p95_mm), figure(row.worst_mm), share(row.share_above_2_mm),
                       figure(row.mean_nees), figure(row.us_per_update));
  }
  return out;
}

nlohmann::json to_json(const Experiment& experiment) {
  nlohmann::json rows = nlohmann::json::array();
  for (const MethodRow& row : experiment.rows) {
    rows.push_back({{"method", row.method},
                    {"features", row.features},
                    {"median_mm", json_number(row.median_mm)},
                    {"p95_mm", json_number(row.p95_mm)},
                    {"worst_mm", json_number(row.worst_mm)},
                    {"share_above_2_mm", json_number(row.share_above_2_mm)},
                    {"nees_over_3", json_number(row.mean_nees)},
                    {"us_per_update", json_number(row.us_per_update)}});
  }
  return {{"experiment", experiment.number}, {"title", experiment.title},   {"setting", experiment.setting},
          {"seed", experiment.seed},         {"trials", experiment.trials}, {"methods", rows}};
}

std::string to_csv(const Experiment& experiment) {
  std::string out = "method,features,median_mm,p95_mm,worst_mm,share_above_2_mm,nees_over_3,us_per_update\n";
  for (const MethodRow& row : experiment.rows) {
    out += fmt::format("{},{},{},{},{},{},{},{}\n", csv_text(row.method), row.features, row.median_mm, row.p95_mm,
                       row.worst_mm, row.share_above_2_mm, row.mean_nees, row.us_per_update);
  }
  return out;
}

std::string to_csv(const ExperimentFigure& figure) {
  std::string out = "plot,line,x,y\n";
  for (const Plot& plot : figure.plots) {
    std::string label;
    for (const PlotLine& line : plot.lines) {
      // A line without a label continues the kind of the one before.
      if (!line.label.empty()) label = line.label;
      for (const PlotPoint& p : line.points)
        out += fmt::format("{},{},{},{}\n", csv_text(plot.title), csv_text(label), p.x, p.y);
    }
  }
  return out;
}

std::string to_html(const Experiment& experiment) {
  std::string out = fmt::format(
      "<p>{}; {} trials, seed {}.</p>\n<table><tr><th>path error (mm)</th><th>features</th><th>median</th><th>95 %</th>"
      "<th>worst</th><th>&gt; 2 mm</th><th>NEES/3</th><th>&micro;s an update</th></tr>\n",
      escaped(experiment.setting), experiment.trials, experiment.seed);
  for (const MethodRow& row : experiment.rows) {
    out += fmt::format(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        row.method, row.features, figure(row.median_mm), figure(row.p95_mm), figure(row.worst_mm),
        share(row.share_above_2_mm), figure(row.mean_nees), figure(row.us_per_update));
  }
  out += "</table>\n";
  for (const ExperimentFigure& one : experiment.figures)
    out += "<h2>" + one.title + "</h2>\n" + svg_document(one.plots, one.title);
  return html_page(experiment.title, out);
}

}  // namespace perimap
