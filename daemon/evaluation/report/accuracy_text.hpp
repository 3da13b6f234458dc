// An accuracy report for people and for machines.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/evaluation/report/accuracy.hpp"

namespace perimap {

// A few lines, the last without a line end.
[[nodiscard]] std::string to_text(const AccuracyReport& report);
[[nodiscard]] nlohmann::json to_json(const AccuracyReport& report);

}  // namespace perimap
