#include "daemon/evaluation/traces/trace_text.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "daemon/evaluation/json/json_number.hpp"

namespace perimap {

std::string to_table(const TraceExperiment& experiment) {
  std::string out = fmt::format(
      "Experiment 3: motion of a real heart, predicted from samples {} to {} by what came before each\n"
      "heart {:.0f} /min, breathing {:.1f} /min, phases by {}\n\nRMSE mm (lateral)",
      experiment.from, experiment.to, 60.0 * experiment.rates.cardiac_hz, 60.0 * experiment.rates.respiratory_hz,
      experiment.with_r_peaks ? "R peaks and motion" : "the motion alone");
  for (const TraceRow& row : experiment.rows) {
    if (row.name == experiment.rows.front().name && row.point == kAllPoints)
      out += fmt::format("{:>12.0f} ms", row.horizon_ms);
  }
  // A line a name and point, a column a horizon.
  std::map<std::string, std::string> nees;
  for (const TraceRow& first : experiment.rows) {
    if (first.horizon_ms != experiment.rows.front().horizon_ms) continue;
    out += fmt::format("\n{:<9}{:<8}", first.name, first.point);
    for (const TraceRow& row : experiment.rows) {
      if (row.name != first.name || row.point != first.point) continue;
      out += fmt::format("{:>7.3f} ({:.3f})", row.rmse_mm, row.rmse_lateral_mm);
      if (std::isfinite(row.nees)) nees[row.point] += fmt::format("{:>15.2f}", row.nees);
    }
  }
  out += "\n\nNEES/3 of ours (1 when its covariance is right)";
  for (const auto& [point, text] : nees) out += fmt::format("\n         {:<8}{}", point, text);
  return out +
         "\n\nPublished of point AP3 of the in vivo trace, 50 starts from sample 600 (Zhang et al., IEEE SPL 2022): "
         "LSTM "
         "0.31, 0.40,\n0.53 mm at 40, 120, 400 ms; AR(35) 0.37, 0.49, 0.76.\n";
}

nlohmann::json to_json(const TraceExperiment& experiment) {
  nlohmann::json rows = nlohmann::json::array();
  for (const TraceRow& row : experiment.rows) {
    rows.push_back({{"name", row.name},
                    {"point", row.point},
                    {"horizon_ms", std::round(row.horizon_ms * 1e3) / 1e3},
                    {"rmse_mm", json_number(row.rmse_mm)},
                    {"rmse_lateral_mm", json_number(row.rmse_lateral_mm)},
                    {"nees_over_3", json_number(row.nees)},
                    {"starts", row.starts}});
  }
  return {{"experiment", 3},
          {"from", experiment.from},
          {"to", experiment.to},
          {"r_peaks", experiment.with_r_peaks},
          {"heart_hz", experiment.rates.cardiac_hz},
          {"breathing_hz", experiment.rates.respiratory_hz},
          {"rows", rows}};
}

std::string to_csv(const TraceExperiment& experiment) {
  std::string out = "name,point,horizon_ms,rmse_mm,rmse_lateral_mm,nees_over_3,starts\n";
  for (const TraceRow& row : experiment.rows) {
    out += fmt::format("{},\"{}\",{:.3f},{:.6g},{:.6g},{},{}\n", row.name, row.point, row.horizon_ms, row.rmse_mm,
                       row.rmse_lateral_mm, std::isfinite(row.nees) ? fmt::format("{:.4g}", row.nees) : "", row.starts);
  }
  return out;
}

std::vector<Plot> to_plots(const TraceExperiment& experiment) {
  const std::pair<const char*, const char*> colours[] = {{"hold", "#999999"},
                                                         {"ar_point", "#b8860b"},
                                                         {"ar_all", "#c0392b"},
                                                         {"periodic", "#1f6f8b"},
                                                         {"ours", "#1a7f37"}};
  std::vector<Plot> plots;
  for (const bool lateral : {false, true}) {
    Plot plot;
    plot.title = lateral ? "across the line of sight" : "in space";
    plot.x_label = "ahead, ms";
    plot.y_label = "RMSE, mm";
    plot.y_from_zero = true;
    for (const auto& [name, colour] : colours) {
      PlotLine line;
      line.color = colour;
      line.label = name;
      for (const TraceRow& row : experiment.rows) {
        if (row.name != name || row.point != kAllPoints) continue;
        line.points.push_back({row.horizon_ms, lateral ? row.rmse_lateral_mm : row.rmse_mm});
      }
      plot.lines.push_back(std::move(line));
    }
    plots.push_back(std::move(plot));
  }
  return plots;
}

}  // namespace perimap
