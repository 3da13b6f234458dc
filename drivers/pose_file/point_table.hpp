// Named points as a table: name,x,y,z.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "drivers/pose_file/pose_table.hpp"

namespace perimap {

struct NamedPoint {
  std::string name;
  Vector3d p = Vector3d::Zero();  // mm
};

// A heading or none; lines that begin with "#" are comments. Each name once. Errors name the file and line.
[[nodiscard]] Expected<std::vector<NamedPoint>> parse_point_table(std::string_view text, std::string_view name,
                                                                  LengthUnit unit);
[[nodiscard]] Expected<std::vector<NamedPoint>> read_point_table(const std::filesystem::path& file, LengthUnit unit);

}  // namespace perimap
