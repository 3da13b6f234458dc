// Where two configurations differ.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/configuration.hpp"

namespace perimap {

// The keys, "section.name", whose values are not the same.
[[nodiscard]] std::vector<std::string> differing_keys(const Configuration& a, const Configuration& b);

}  // namespace perimap
