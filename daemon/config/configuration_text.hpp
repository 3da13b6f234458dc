// A configuration as the text of a file.
#pragma once

#include <string>

#include "daemon/config/configuration.hpp"

namespace perimap {

// The configuration as TOML, all keys, each with its meaning as a comment; parsing it gives the same configuration.
[[nodiscard]] std::string to_toml(const Configuration& configuration);

// Likewise, but what describes the session alone: what a recording of it brings along.
[[nodiscard]] std::string session_toml(const Configuration& configuration);

}  // namespace perimap
