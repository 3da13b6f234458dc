// A procedure's score for people and programs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/evaluation/procedure/procedure_score.hpp"

namespace perimap {

[[nodiscard]] std::string to_text(const ProcedureScore& score);
[[nodiscard]] nlohmann::json to_json(const ProcedureScore& score);

}  // namespace perimap
