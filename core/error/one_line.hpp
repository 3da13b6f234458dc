// Error messages are one line, whatever text of a file or device they quote.
#pragma once

#include <string>

namespace perimap {

// The text with every control character replaced by a space; UTF-8 passes.
[[nodiscard]] inline std::string on_one_line(std::string text) {
  for (char& c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) c = ' ';
  }
  return text;
}

}  // namespace perimap
