// A line by which a text that a program has written tells whether it still is as it was written.
#pragma once

#include <string>
#include <string_view>

#include "core/error/expected.hpp"

namespace perimap {

// `head`, then the line "# perimap-crc32 1a2b3c4d ...", then `rest`, whose CRC-32 it has. For texts in which a line
// that begins with # says nothing (YAML, TOML). Without a figure that is wrong such a text reads as well when a digit
// of it is another, or its end is missing.
[[nodiscard]] std::string sealed_text(std::string_view head, std::string_view rest);

// Of a text in whose first lines there is such a line: what follows is as it was written. A text without one is
// anybody's, and right. The error says what to do, and is for a message that names the file.
[[nodiscard]] Expected<void> check_seal(std::string_view text);

}  // namespace perimap
