// An experiment as text: table, JSON, CSV, HTML.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/evaluation/experiment/experiment.hpp"

namespace perimap {

[[nodiscard]] std::string to_table(const Experiment& experiment);
// Values that are not finite become null.
[[nodiscard]] nlohmann::json to_json(const Experiment& experiment);
// The table, one row a method.
[[nodiscard]] std::string to_csv(const Experiment& experiment);
// A figure's points: plot,line,x,y.
[[nodiscard]] std::string to_csv(const ExperimentFigure& figure);
// One page without references to anything outside: the table and the figures as inline SVG.
[[nodiscard]] std::string to_html(const Experiment& experiment);

}  // namespace perimap
