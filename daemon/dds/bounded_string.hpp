// Text in the bounded strings of published types.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace perimap::dds {

// Copies what fits and closes it with a NUL.
template <std::size_t N>
void assign(char (&destination)[N], std::string_view text) noexcept {
  const std::size_t length = std::min(text.size(), N - 1);
  std::copy_n(text.data(), length, destination);
  destination[length] = '\0';
}

}  // namespace perimap::dds
