// A grey picture as a JPEG, by libjpeg: for those who look at it.
#pragma once

#include <string>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

// The file's bytes. `quality`: 1 to 100. Fails when the picture is empty or larger than a JPEG can be.
[[nodiscard]] Expected<std::string> encode_jpeg(const GreyImage& image, int quality);

}  // namespace perimap
