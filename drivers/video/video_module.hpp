// What libperimap_video.so, the module that reads and writes videos, gives the program that loads it. Both are of one
// build.
#pragma once

#include <memory>
#include <string>

#include "drivers/video/picture_file.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {

struct VideoModule {
  // As VideoReader::open() and VideoWriter::create().
  Expected<std::unique_ptr<VideoReader>> (*open)(const std::string& path);
  Expected<std::unique_ptr<VideoWriter>> (*create)(const std::string& path, int width, int height, double frames_per_s);
  // As read_picture().
  Expected<PictureFile> (*read_picture)(const std::string& path);
};

inline constexpr const char* kVideoModule = "libperimap_video.so";
inline constexpr const char* kVideoModuleEntry = "perimap_video_module";

}  // namespace perimap

// Never null. By the name above.
extern "C" [[gnu::visibility("default")]] const perimap::VideoModule* perimap_video_module();
