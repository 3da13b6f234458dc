// Pictures as a command line names them: files, folders of them, videos.
#pragma once

#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"
#include "drivers/video/picture_file.hpp"

namespace perimap {

struct NamedPicture {
  std::string name;
  PictureFile picture;

  [[nodiscard]] GreyImage grey() const { return {picture.grey.data(), picture.width, picture.height, picture.width}; }
};

// All of one size; two a second of a video. An error names the file.
[[nodiscard]] Expected<std::vector<NamedPicture>> read_pictures(const std::vector<std::string>& named);

}  // namespace perimap
