// The set-up of a scope that is turned in its camera head, as `perimap calibrate scope --at --output` writes it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/calibration/turned_scope.hpp"
#include "core/error/expected.hpp"

namespace perimap {

// JSON with the key 'turned_scope'; what else there is is passed over. Errors name the file and the key.
[[nodiscard]] Expected<TurnedScope> read_turned_scope(const std::filesystem::path& file);
// The same from memory; `name` stands in messages.
[[nodiscard]] Expected<TurnedScope> parse_turned_scope(std::string_view text, std::string_view name);

[[nodiscard]] std::string format_turned_scope(const TurnedScope& scope);

}  // namespace perimap
