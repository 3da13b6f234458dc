// Tables of numbers as programs write them: a heading or none, fields between commas, semicolons, tabs or spaces.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct NumberTable {
  std::vector<std::string> heading;       // empty without one
  std::vector<std::vector<double>> rows;  // all as long as the first; a field that is empty or "nan" is not a number
  std::vector<std::size_t> lines;         // of each row in the file, from 1
};

// Errors name the file, the line and the field. Lines that begin with "#" are comments.
[[nodiscard]] Expected<NumberTable> parse_number_table(std::string_view text, std::string_view name);

}  // namespace perimap
