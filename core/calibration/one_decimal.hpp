// A number as a message shows it.
#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace perimap {

[[nodiscard]] inline std::string one_decimal(double value) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.1f", value);
  return text.data();
}

}  // namespace perimap
