// SVG pictures as PNG, for documents that show no SVG.
#pragma once

#include <string>

#include "core/error/expected.hpp"

namespace perimap {

// The bytes of a PNG that is `scale` times as large as the SVG says. The error says what the renderer did not like.
[[nodiscard]] Expected<std::string> png_of_svg(const std::string& svg, double scale = 1.0);

}  // namespace perimap
