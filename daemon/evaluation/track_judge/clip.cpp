#include "daemon/evaluation/track_judge/clip.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace perimap {

Expected<Clip> Clip::read(const std::string& path, std::size_t first, std::size_t frames) {
  auto reader = VideoReader::open(path);
  if (!reader) return tl::unexpected(reader.error());
  Clip clip;
  clip.frames_per_s_ = (*reader)->frames_per_s();
  for (std::size_t read = 0; clip.frames_.size() < frames; ++read) {
    const auto next = (*reader)->next();
    if (!next) return tl::unexpected(next.error());
    if (*next == nullptr) break;
    if (read < first) continue;
    const VideoFrame& given = **next;
    clip.width_ = given.grey.width;
    clip.height_ = given.grey.height;
    const auto width = static_cast<std::size_t>(clip.width_);
    Frame& kept = clip.frames_.emplace_back();
    kept.luminance.reserve(width * static_cast<std::size_t>(clip.height_));
    for (int y = 0; y < clip.height_; ++y) {
      const std::uint8_t* const bgr = given.colour.row(y);
      const std::uint8_t* const grey = given.grey.row(y);
      kept.bgr.insert(kept.bgr.end(), bgr, bgr + 3 * width);
      kept.grey.insert(kept.grey.end(), grey, grey + width);
      for (std::size_t x = 0; x < width; ++x) {
        const int thousandths = 114 * bgr[3 * x] + 587 * bgr[3 * x + 1] + 299 * bgr[3 * x + 2];
        kept.luminance.push_back(static_cast<std::uint8_t>((thousandths + 500) / 1000));
      }
    }
  }
  if (clip.frames_.size() < 2) {
    return fail(fmt::format("{}: {} frames from frame {} on: two are needed to play it there and back", path,
                            clip.frames_.size(), first));
  }
  return clip;
}

VideoFrame Clip::at(std::size_t step) const noexcept {
  const Frame& kept = frame(step);
  return {step,
          {kept.bgr.data(), width_, height_, std::ptrdiff_t{3} * width_},
          {kept.grey.data(), width_, height_, width_}};
}

GreyImage Clip::luminance(std::size_t step) const noexcept {
  return {frame(step).luminance.data(), width_, height_, width_};
}

}  // namespace perimap
