// Files that are read: on a disk, and nothing else.
#pragma once

#include <filesystem>
#include <string>
#include <tl/expected.hpp>

#include "drivers/file/descriptor.hpp"

namespace perimap {

// Opens the file for reading. Never waits: the opening of a pipe lasts until someone writes to it, whatever signals
// come meanwhile, so a pipe, a device and a folder are refused. The error is the reason alone, such as "No such file or
// directory" or "a pipe, and no file", for a message that names the file.
[[nodiscard]] tl::expected<Descriptor, std::string> open_regular_file(const std::filesystem::path& file);

}  // namespace perimap
