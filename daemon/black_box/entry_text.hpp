// Entries of a black box for people and programs.
#pragma once

#include <string>

#include "daemon/black_box/entry.hpp"

namespace perimap::black_box {

// One line of JSON: when, what kind, and what it says; of samples their states and counts. Any content is safe.
[[nodiscard]] std::string json_of(const Entry& entry);

}  // namespace perimap::black_box
