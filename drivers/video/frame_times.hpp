// When the frames of a video file are shown. OpenCV's videoio tells the time of the packet that it read last, which
// with frames that are coded out of their order is another frame's.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <queue>
#include <string>
#include <vector>

struct AVFormatContext;

namespace perimap {

// Reads the packets of a file's first video stream beside whoever decodes them, some ahead. Frames come in the order of
// their times, packets nearly so: the earliest of so many is the next frame's. Where a file has rounded several frames
// to one time, they are spread evenly up to the next one.
class FrameTimes {
 public:
  // Without times where the file cannot be opened.
  explicit FrameTimes(const std::string& path);
  FrameTimes(const FrameTimes&) = delete;
  FrameTimes& operator=(const FrameTimes&) = delete;
  ~FrameTimes();

  // Of the next frame, s, on a clock that begins anywhere; none: the file tells no time of it, nor of later ones.
  [[nodiscard]] std::optional<double> next();
  // How many of the frames that an MP4 or MOV file holds its edit list has shown; none: all, or it is another kind of
  // file.
  [[nodiscard]] std::optional<std::uint64_t> shown() const noexcept { return shown_; }

 private:
  struct Closing {
    void operator()(AVFormatContext* context) const noexcept;
  };

  [[nodiscard]] std::optional<std::uint64_t> count_shown() const;
  // False at the end, and where a packet has no time.
  [[nodiscard]] bool read_packet();

  std::unique_ptr<AVFormatContext, Closing> context_;
  int stream_ = -1;
  double unit_s_ = 0.0;  // of its times
  bool ended_ = false;
  bool timed_ = true;
  struct Run {
    std::int64_t time = 0;  // that the frames of the run have
    int frames = 0;
    int given = 0;
    std::int64_t length = 0;  // to the next time; at the end as long as the one before
  };
  Run run_;
  std::priority_queue<std::int64_t, std::vector<std::int64_t>, std::greater<>> ahead_;
  std::optional<std::uint64_t> shown_;
};

}  // namespace perimap
