// The experiment on a trace as text: table, JSON, CSV; and as plots.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/evaluation/traces/trace_experiment.hpp"
#include "daemon/pages/svg_plot.hpp"

namespace perimap {

[[nodiscard]] std::string to_table(const TraceExperiment& experiment);
// Values that are not finite become null.
[[nodiscard]] nlohmann::json to_json(const TraceExperiment& experiment);
[[nodiscard]] std::string to_csv(const TraceExperiment& experiment);
// Error over horizon, a line a predictor.
[[nodiscard]] std::vector<Plot> to_plots(const TraceExperiment& experiment);

}  // namespace perimap
