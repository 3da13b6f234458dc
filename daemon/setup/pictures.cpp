#include "daemon/setup/pictures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kMostPictures = 2000;

bool is_video(const std::filesystem::path& path) {
  constexpr std::string_view kVideos[] = {".mp4", ".mkv", ".avi", ".mov", ".mpg", ".m4v", ".webm"};
  return std::find(std::begin(kVideos), std::end(kVideos), path.extension().string()) != std::end(kVideos);
}

// The files, and those of a folder by their names.
std::vector<std::string> files_of(const std::vector<std::string>& named) {
  std::vector<std::string> files;
  for (const std::string& name : named) {
    std::error_code error;
    if (!std::filesystem::is_directory(name, error)) {
      files.push_back(name);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : std::filesystem::directory_iterator(name, error)) {
      if (entry.is_regular_file(error)) inside.push_back(entry.path().string());
    }
    std::sort(inside.begin(), inside.end());
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

// Two a second of a video.
Expected<void> read_video(const std::string& file, std::vector<NamedPicture>& pictures) {
  auto reader = VideoReader::open(file);
  if (!reader) return tl::unexpected(reader.error());
  const double rate = (*reader)->frames_per_s() > 0 ? (*reader)->frames_per_s() : 30.0;
  const auto every = static_cast<std::uint64_t>(std::max(1.0, rate / 2.0));
  std::uint64_t wanted = 0;
  while (pictures.size() < kMostPictures) {
    const auto frame = (*reader)->next();
    if (!frame) return tl::unexpected(frame.error());
    if (*frame == nullptr) break;
    if ((*frame)->number < wanted) continue;
    wanted = (*frame)->number + every;
    const GreyImage& grey = (*frame)->grey;
    NamedPicture picture{fmt::format("{}, frame {}", file, (*frame)->number), {grey.width, grey.height, {}}};
    for (int y = 0; y < grey.height; ++y) {
      const auto* row = grey.data + y * grey.stride;
      picture.picture.grey.insert(picture.picture.grey.end(), row, row + grey.width);
    }
    pictures.push_back(std::move(picture));
  }
  return {};
}

}  // namespace

Expected<std::vector<NamedPicture>> read_pictures(const std::vector<std::string>& named) {
  std::vector<NamedPicture> pictures;
  for (const std::string& file : files_of(named)) {
    if (is_video(file)) {
      if (const auto read = read_video(file, pictures); !read) return tl::unexpected(read.error());
    } else {
      auto picture = read_picture(file);
      if (!picture) return tl::unexpected(picture.error());
      pictures.push_back({file, *std::move(picture)});
    }
    const PictureFile& first = pictures.front().picture;
    const PictureFile& last = pictures.back().picture;
    if (last.width != first.width || last.height != first.height) {
      return fail(fmt::format("{}: is {}x{}, and {} is {}x{}: pictures of one camera, uncut, are needed",
                              pictures.back().name, last.width, last.height, pictures.front().name, first.width,
                              first.height));
    }
  }
  if (pictures.empty()) return fail("there are no pictures");
  return pictures;
}

}  // namespace perimap
