// A borrowed 8-bit grey image.
#pragma once

#include <cstddef>
#include <cstdint>

namespace perimap {

// Row y starts at data + y * stride. Pixel centres lie at integer coordinates (u right, v down).
struct GreyImage {
  const std::uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;  // bytes from row to row, >= width

  [[nodiscard]] const std::uint8_t* row(int y) const noexcept { return data + y * stride; }
};

}  // namespace perimap
