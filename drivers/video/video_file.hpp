// Video files of any kind that OpenCV's videoio (FFmpeg) reads and writes.
//
// It brings more than 200 shared libraries: a quarter of a second of every start, and 280 MB of a process that locks
// its memory. So they are loaded when a video is first asked for, as a module of their own (video_module.hpp).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
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
  std::optional<double> time_s = {};  // since the first frame, as the container has it; none: it tells no time
};

// Loads what reads and writes videos, once; else the first open() or create() does. To be called before threads have
// priority and memory is locked. Fails when the module, or one of its libraries, is not there; the error names it.
[[nodiscard]] Expected<void> load_video_support();

class VideoReader {
 public:
  // Fails when the file is not there, is no video, or its first frame can not be decoded, and names it then; and as
  // load_video_support() does.
  [[nodiscard]] static Expected<std::unique_ptr<VideoReader>> open(const std::string& path);
  VideoReader() = default;
  VideoReader(VideoReader&&) = delete;
  VideoReader& operator=(VideoReader&&) = delete;
  VideoReader(const VideoReader&) = delete;
  VideoReader& operator=(const VideoReader&) = delete;
  virtual ~VideoReader() = default;

  // As the container says, or as its length and usual rate let guess; 0 when it does not.
  [[nodiscard]] virtual std::uint64_t announced_frames() const noexcept = 0;
  [[nodiscard]] virtual double frames_per_s() const noexcept = 0;
  // After the end: whether the last frame's time, or their number where frames have no times, is so far from what is
  // announced that something must be missing.
  [[nodiscard]] virtual bool ends_early() const noexcept = 0;

  // Null at the end. Frames that cannot be decoded are passed over while fewer have come than the container announces.
  // A frame of another size than the first ends the reading with an error.
  [[nodiscard]] virtual Expected<const VideoFrame*> next() = 0;
};

// A mark on a frame: a circle with a cross in it.
struct VideoMark {
  double u = 0;  // px
  double v = 0;
  std::uint8_t blue = 0, green = 0, red = 0;
};

class VideoWriter {
 public:
  // Motion JPEG, which every player knows, in the container that the path's extension names (.mkv, .avi, .mov). Fails
  // when the file cannot be written, and as load_video_support() does.
  [[nodiscard]] static Expected<std::unique_ptr<VideoWriter>> create(const std::string& path, int width, int height,
                                                                     double frames_per_s);
  VideoWriter() = default;
  VideoWriter(VideoWriter&&) = delete;
  VideoWriter& operator=(VideoWriter&&) = delete;
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;
  virtual ~VideoWriter() = default;

  // The frame with the marks drawn on a copy of it; in grey when its colour is reduced or not there.
  [[nodiscard]] virtual Expected<void> write(const VideoFrame& frame, const std::vector<VideoMark>& marks) = 0;
  // Closes the file, and looks whether its last frame can be read. Without it the file is closed too, but nothing is
  // said of an error.
  [[nodiscard]] virtual Expected<void> finish() = 0;
};

}  // namespace perimap
