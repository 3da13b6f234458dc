// Files that a group may read beside their owner.
#pragma once

#include <filesystem>
#include <string>

#include "core/error/expected.hpp"

namespace perimap {

// Gives the file to the group, which may read it from now on; nobody else but its owner may. Error: "FILE: cannot be
// given to the group 'surgeons': there is no such group on this machine".
[[nodiscard]] Expected<void> let_group_read(const std::filesystem::path& file, const std::string& group);

}  // namespace perimap
