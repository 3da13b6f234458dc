// TOML that a person wrote, or a stranger: what the library must not see is refused before it does.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "drivers/toml/toml.hpp"

namespace perimap {

// A generous bound for a file written by hand. It also bounds the recursion of the TOML library, which is as deep as
// a dotted key is long.
inline constexpr std::size_t kLargestToml = std::size_t{64} * 1024;

// The table of a text. Errors are one line, "FILE:LINE:COL: expected ..., got ...": of a text that is too long, that is
// no TOML 1.0, or that has what toml++ 3.3 does not survive (letters beyond ASCII outside of strings and comments,
// strings over several lines, keys of very many parts).
[[nodiscard]] Expected<toml::table> parse_toml(std::string_view text, const std::filesystem::path& file);

// A value as a message repeats it, cut where it is long.
[[nodiscard]] std::string describe(const toml::node& node);

}  // namespace perimap
