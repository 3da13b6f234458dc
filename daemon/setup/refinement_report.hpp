// What `perimap refine` says of a result: as text, and as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/refinement/model_refinement.hpp"

namespace perimap {

[[nodiscard]] std::string text_of(const Refinement& refinement, const RefinementSource& source);
// As a registration by landmarks has it, with what is of a refinement alone.
[[nodiscard]] nlohmann::json json_of(const Refinement& refinement);

}  // namespace perimap
