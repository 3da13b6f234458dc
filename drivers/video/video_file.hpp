// Video files of any kind that OpenCV's videoio (FFmpeg) reads and writes.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

// One frame, in colour and in grey: its green channel, in which blood absorbs most, so that vessels stand out, and
// which clips last. Valid until the next one is read.
struct VideoFrame {
  // Counted from 0; from the first frame that could not be decoded on, by the video's times at its usual rate.
  std::uint64_t number = 0;
  ColourImage colour;  // in a video's frames as large as the grey; may be reduced elsewhere, or without pixels
  GreyImage grey;
};

class VideoReader {
 public:
  // Fails when the file is not there, is no video, or its first frame can not be decoded; the error names it.
  [[nodiscard]] static Expected<VideoReader> open(const std::string& path);
  VideoReader(VideoReader&&) noexcept;
  VideoReader& operator=(VideoReader&&) = delete;
  VideoReader(const VideoReader&) = delete;
  VideoReader& operator=(const VideoReader&) = delete;
  ~VideoReader();

  // As the container says, or as its length and usual rate let guess; 0 when it does not.
  [[nodiscard]] std::uint64_t announced_frames() const noexcept;
  [[nodiscard]] double frames_per_s() const noexcept;
  // After the end: whether the last frame's time, or their number where frames have no times, is so far from what is
  // announced that something must be missing.
  [[nodiscard]] bool ends_early() const noexcept;

  // Null at the end. Frames that cannot be decoded are passed over while fewer have come than the container announces.
  // A frame of another size than the first ends the reading with an error.
  [[nodiscard]] Expected<const VideoFrame*> next();

 private:
  struct Impl;
  explicit VideoReader(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

// A mark on a frame: a circle with a cross in it.
struct VideoMark {
  double u = 0;  // px
  double v = 0;
  std::uint8_t blue = 0, green = 0, red = 0;
};

class VideoWriter {
 public:
  // Motion JPEG, which every player knows, in the container that the path's extension names (.mkv, .avi, .mov).
  [[nodiscard]] static Expected<VideoWriter> create(const std::string& path, int width, int height,
                                                    double frames_per_s);
  VideoWriter(VideoWriter&&) noexcept;
  VideoWriter& operator=(VideoWriter&&) = delete;
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;
  ~VideoWriter();

  // The frame with the marks drawn on a copy of it; in grey when its colour is reduced or not there.
  [[nodiscard]] Expected<void> write(const VideoFrame& frame, const std::vector<VideoMark>& marks);
  // Closes the file, and looks whether its last frame can be read. Without it the file is closed too, but nothing is
  // said of an error.
  [[nodiscard]] Expected<void> finish();

 private:
  struct Impl;
  explicit VideoWriter(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace perimap
