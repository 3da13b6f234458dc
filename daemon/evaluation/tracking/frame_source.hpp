// Frames to follow features through.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {

// Frames one by one, from a video or a recording.
class FrameSource {
 public:
  // Of a video that OpenCV reads, or of a recording; of either what is whole.
  [[nodiscard]] static Expected<std::unique_ptr<FrameSource>> open(const std::string& path);

  virtual ~FrameSource() = default;
  // Null at the end; valid until the next call.
  [[nodiscard]] virtual Expected<const VideoFrame*> next() = 0;
  // Of the frame given last, in its size or reduced; without pixels when it has none.
  [[nodiscard]] virtual ColourImage colour() = 0;
  [[nodiscard]] virtual std::uint64_t announced_frames() const = 0;
  [[nodiscard]] virtual double frames_per_s() const = 0;
  // What could not be read, once next() has given null.
  [[nodiscard]] virtual std::vector<Error> damage() const = 0;
};

}  // namespace perimap
