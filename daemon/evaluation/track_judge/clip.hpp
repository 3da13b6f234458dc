// A stretch of video held in memory, so that it can be played both ways.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/grey_image.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {

// There and back: frames 0, 1, ... n - 1, n - 2, ... 0.
class Clip {
 public:
  // `frames` of the video from `first` on, or as many as there are; at least two. The error names the file.
  [[nodiscard]] static Expected<Clip> read(const std::string& path, std::size_t first, std::size_t frames);

  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  [[nodiscard]] double frames_per_s() const noexcept { return frames_per_s_; }
  [[nodiscard]] std::size_t frames() const noexcept { return frames_.size(); }
  [[nodiscard]] std::size_t steps() const noexcept { return 2 * frames_.size() - 1; }
  // The step at which it turns.
  [[nodiscard]] std::size_t turn() const noexcept { return frames_.size() - 1; }
  // Of the way there and back, as a video would give it.
  [[nodiscard]] VideoFrame at(std::size_t step) const noexcept;
  // The luminance (ITU-R BT.601), which others track in.
  [[nodiscard]] GreyImage luminance(std::size_t step) const noexcept;

 private:
  struct Frame {
    std::vector<std::uint8_t> bgr, grey, luminance;
  };
  [[nodiscard]] const Frame& frame(std::size_t step) const noexcept {
    return frames_[step < frames_.size() ? step : steps() - 1 - step];
  }

  int width_ = 0, height_ = 0;
  double frames_per_s_ = 0;
  std::vector<Frame> frames_;
};

}  // namespace perimap
