// Pictures as files, of any kind that OpenCV's imgcodecs reads; by the module that reads videos (video_file.hpp).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct PictureFile {
  int width = 0;  // px
  int height = 0;
  std::vector<std::uint8_t> grey;  // row by row, without gaps
};

// In grey, not turned by what the file says of the camera's attitude. Fails when the file is not there or no picture,
// and as load_video_support() does.
[[nodiscard]] Expected<PictureFile> read_picture(const std::string& path);

}  // namespace perimap
