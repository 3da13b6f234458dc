// A calibrated tool's tip as `perimap calibrate tool --output` wrote it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

struct ToolTip {
  Vector3d tip_T = Vector3d::Zero();         // in the tool's frame, mm
  Matrix3d covariance_T = Matrix3d::Zero();  // mm^2
};

// Errors name the file and the key.
[[nodiscard]] Expected<ToolTip> read_tool_tip(const std::filesystem::path& file);

// The same from memory; `name` stands in messages.
[[nodiscard]] Expected<ToolTip> parse_tool_tip(std::string_view text, std::string_view name);

// What parse_tool_tip() reads; `tool`: of which it is.
[[nodiscard]] std::string format_tool_tip(const ToolTip& tip, const std::string& tool);

}  // namespace perimap
