// Files that are opened to be written, whatever they are.
#pragma once

#include <filesystem>
#include <string>
#include <tl/expected.hpp>

#include "drivers/file/descriptor.hpp"

namespace perimap {

// Opens the file for writing, emptied, or made for its owner alone. The opening of a pipe would last until someone
// reads from it, whatever signals come meanwhile: one that nobody reads from is refused after a second, in which its
// reader may begin. The error is the reason alone, such as "Permission denied" or "a pipe that nobody reads from", for
// a message that names the file.
[[nodiscard]] tl::expected<Descriptor, std::string> open_output_file(const std::filesystem::path& file);

}  // namespace perimap
