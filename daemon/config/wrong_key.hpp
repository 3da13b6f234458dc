// What turns out to be wrong with a configuration that was read well: keys that do not go together, or not with the
// files that they name.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct WrongKey {
  std::string key;   // "tracker.port"
  std::string what;  // "expected ..., got ...", and what to do next
};
using WrongKeys = std::vector<WrongKey>;

// All of it, a line each, in the order of the file: `FILE:LINE:COL: key 'a.b': expected ..., got ...`. A key that the
// file does not hold is told at its section, and without a place where there is none. What is said twice is told once.
[[nodiscard]] Error told_in(const std::filesystem::path& file, WrongKeys wrong);
// The same of a text that is not the file's yet.
[[nodiscard]] Error told_in(const std::filesystem::path& file, std::string_view text, WrongKeys wrong);

void append(WrongKeys& wrong, WrongKeys more);

}  // namespace perimap
