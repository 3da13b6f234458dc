// Figures in JSON.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

namespace perimap {

// Null where the value is not finite: JSON has no other number for it.
[[nodiscard]] inline nlohmann::json json_number(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
}

}  // namespace perimap
