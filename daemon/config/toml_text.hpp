// A configuration's text as TOML.
#pragma once

// toml++ as headers, so that the fuzzer and the sanitizers see into it, and with its internal assertions off: one of
// version 3.3 fails on a wrong file ("[(a]"), which the code behind it reports well. With NDEBUG it would become an
// assumption of the optimiser, so that has to go here too. For the files of this folder alone.
#undef NDEBUG
#define TOML_ASSERT(expression) static_assert(true)
#define TOML_HEADER_ONLY 1
#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>

#include <cstddef>
#include <filesystem>
#include <string_view>

#include "core/error/expected.hpp"

namespace perimap {

// A generous bound for a file written by hand, bytes. It also bounds the recursion of the TOML library, which is as
// deep as a dotted key is long.
inline constexpr std::size_t kLargestConfiguration = std::size_t{64} * 1024;

// `file` stands in messages. What toml++ must not see is refused before, with line and column like all else that is no
// TOML.
[[nodiscard]] Expected<toml::table> parse_toml(std::string_view text, const std::filesystem::path& file);

}  // namespace perimap
