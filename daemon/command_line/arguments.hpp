// What was typed, and what was meant.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace perimap {

// Parses a program's arguments. None: go on. Otherwise the exit code with which to end, after the help or the version,
// or after all that is wrong was told: of a misspelt command or option with the one that may have been meant.
[[nodiscard]] std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv);

// A line for each thing that is wrong, after the command's parsing ended so.
[[nodiscard]] std::vector<std::string> what_is_wrong(const CLI::App& command, const CLI::ParseError& error);

}  // namespace perimap
