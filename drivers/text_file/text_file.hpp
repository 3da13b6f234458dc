// Small text files: what people write by hand (configurations, calibrations) and what programs leave for them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "drivers/file/whole_file.hpp"

namespace perimap {

// The file's text, at most largest + 1 bytes of it, so that a parser can refuse what is too long. `what` names the kind
// of file in errors: "FILE: expected a readable WHAT, got: No such file or directory". What is no regular file is
// refused at once: a pipe would be waited for.
[[nodiscard]] Expected<std::string> read_text_file(const std::filesystem::path& file, std::size_t largest,
                                                   std::string_view what);

// Replaces the file by the text, byte for byte, or leaves it as it was (WholeFile). Error: "FILE: cannot be written: No
// space left on device".
[[nodiscard]] Expected<void> write_text_file(const std::filesystem::path& file, std::string_view text,
                                             WholeFile::Readers readers = WholeFile::Readers::kAsBefore);

}  // namespace perimap
