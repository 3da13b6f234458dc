#include "drivers/video/video_file.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "drivers/video/video_module.hpp"

namespace perimap {
namespace {

// Looked for where the programs' run path says (CMAKE_BUILD_RPATH, INSTALL_RPATH). Never unloaded: OpenCV and
// FFmpeg leave threads and handlers behind.
Expected<const VideoModule*> load() {
  const auto failed = [] {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): each thread has its own in glibc
    return fail(fmt::format("videos can not be read or written: {}", dlerror()));
  };
  void* const library = dlopen(kVideoModule, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return failed();
  const auto entry = reinterpret_cast<decltype(&perimap_video_module)>(dlsym(library, kVideoModuleEntry));
  if (entry == nullptr) return failed();
  return entry();
}

const Expected<const VideoModule*>& module() {
  static const Expected<const VideoModule*> loaded = load();
  return loaded;
}

}  // namespace

Expected<void> load_video_support() {
  return module().map([](const VideoModule*) {});
}

Expected<std::unique_ptr<VideoReader>> VideoReader::open(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return fail(path + ": there is no such file");
  if (!std::filesystem::is_regular_file(path, error)) return fail(path + ": a folder or a device, not a video file");
  return module().and_then([&](const VideoModule* video) { return video->open(path); });
}

Expected<std::unique_ptr<VideoWriter>> VideoWriter::create(const std::string& path, int width, int height,
                                                           double frames_per_s) {
  return module().and_then([&](const VideoModule* video) { return video->create(path, width, height, frames_per_s); });
}

Expected<PictureFile> read_picture(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return fail(path + ": there is no such picture");
  return module().and_then([&](const VideoModule* video) { return video->read_picture(path); });
}

}  // namespace perimap
