// Options that are themselves the value of an option: --simulated "--seed 7 --ecg 119".
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

class Command;

// Parses the words by the options that are added, and by no other; there is no help among them. An error has a line for
// each thing that is wrong, as of a command.
[[nodiscard]] Expected<void> parse_nested_options(const std::vector<std::string>& words,
                                                  const std::function<void(Command&)>& add_options);

// The same error, each line of it after the name of the option whose value is wrong.
[[nodiscard]] Error told_of_option(const std::string& option, const Error& error);

}  // namespace perimap
