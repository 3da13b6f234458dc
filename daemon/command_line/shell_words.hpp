// A text that holds several arguments.
#pragma once

#include <string>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

// The words that a POSIX shell would make of the text: quotes keep spaces together, `~` is a home, `$NAME` a variable
// of the environment. Nothing is run. Errors say what the text has that ends no word, a command in it for one.
[[nodiscard]] Expected<std::vector<std::string>> split_as_a_shell(const std::string& text);

}  // namespace perimap
