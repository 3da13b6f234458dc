// What was typed, and what was meant.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace perimap {

// Parses a program's arguments. None: go on. Otherwise the exit code with which to end, after the help or the version,
// or after all that is wrong was told: of a misspelt command or option with the one that may have been meant.
[[nodiscard]] std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv);

}  // namespace perimap
