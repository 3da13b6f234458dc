// The module of video_module.hpp, over OpenCV's videoio.

#include "drivers/video/video_module.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/vision/opencv_threads.hpp"
#include "drivers/video/frame_times.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

// What OpenCV throws has several lines.
tl::unexpected<Error> failed(const std::string& path, const std::exception& error) {
  std::string what = error.what();
  std::replace(what.begin(), what.end(), '\n', ' ');
  return fail(path + ": " + what);
}

bool is_plausible_rate(double frames_per_s) noexcept { return frames_per_s > 0.1 && frames_per_s < 2000; }

class CapturingReader final : public VideoReader {
 public:
  explicit CapturingReader(std::string path) : path_(std::move(path)), times_(path_) {}
  [[nodiscard]] Expected<void> begin();
  [[nodiscard]] std::uint64_t announced_frames() const noexcept override;
  [[nodiscard]] double frames_per_s() const noexcept override;
  [[nodiscard]] bool ends_early() const noexcept override;
  [[nodiscard]] Expected<const VideoFrame*> next() override;

 private:
  [[nodiscard]] bool read() { return capture_.read(colour_) && !colour_.empty(); }
  [[nodiscard]] std::optional<double> time_since_first();
  [[nodiscard]] bool read_next(std::uint64_t announced, double frames_per_s);

  std::string path_;
  cv::VideoCapture capture_;
  cv::Mat colour_, grey_;
  cv::Size size_;
  bool first_is_waiting_ = true;
  std::uint64_t number_ = 0;
  FrameTimes times_;
  std::optional<double> first_s_;     // the first frame's time
  double time_ms_ = 0;                // of the last frame that had one
  std::uint64_t frames_untimed_ = 0;  // since
  bool is_broken_ = false;
  VideoFrame frame_;
};

bool CapturingReader::read_next(std::uint64_t announced, double frames_per_s) {
  constexpr int kMostFailures = 300;  // in a row
  int failures = 0;
  while (!read()) {
    if (number_ + 1 >= announced || ++failures > kMostFailures) return false;
  }
  is_broken_ = is_broken_ || failures > 0;
  ++number_;
  // Beyond a broken spot decoders leave out more frames without a word. Some that they give have no time: 0.
  const double now_ms = capture_.get(cv::CAP_PROP_POS_MSEC);
  const bool is_timed = now_ms > 0 && time_ms_ > 0;
  const double before_ms = time_ms_;
  const std::uint64_t untimed = std::exchange(frames_untimed_, now_ms > 0 ? 0 : frames_untimed_ + 1);
  if (now_ms > 0) time_ms_ = now_ms;
  if (is_broken_ && is_timed && number_ < announced) {
    const double missing = std::round(1e-3 * (now_ms - before_ms) * frames_per_s) - 1 - static_cast<double>(untimed);
    number_ += static_cast<std::uint64_t>(std::clamp(missing, 0.0, static_cast<double>(announced - 1 - number_)));
  }
  return true;
}

Expected<void> CapturingReader::begin() {
  if (!capture_.open(path_, cv::CAP_FFMPEG)) return fail(path_ + ": not a video that can be read");
  if (!read()) return fail(path_ + ": the first frame can not be decoded");
  size_ = colour_.size();
  return {};
}

std::uint64_t CapturingReader::announced_frames() const noexcept {
  if (times_.shown()) return *times_.shown();
  const double count = capture_.get(cv::CAP_PROP_FRAME_COUNT);
  return count > 0 && count < 1e12 ? static_cast<std::uint64_t>(count) : 0;
}

double CapturingReader::frames_per_s() const noexcept {
  const double rate = capture_.get(cv::CAP_PROP_FPS);
  return is_plausible_rate(rate) ? rate : 0;
}

bool CapturingReader::ends_early() const noexcept {
  // Containers round: a frame less is none that is missing, nor is one at a rate that changes.
  constexpr double kMargin = 0.02, kMargin_frames = 2;
  const auto announced = static_cast<double>(announced_frames());
  const double rate = frames_per_s();
  const auto last = static_cast<double>(number_);
  if (last + kMargin_frames >= announced) return false;
  const double reached = rate > 0 && time_ms_ > 0 ? 1e-3 * time_ms_ * rate : last;
  return reached + kMargin_frames < (1 - kMargin) * announced;
}

// Beyond a broken spot nobody knows which packet a frame is of.
std::optional<double> CapturingReader::time_since_first() {
  if (number_ == 0) {
    first_s_ = times_.next();
    return 0.0;
  }
  const std::optional<double> now_s = is_broken_ ? std::nullopt : times_.next();
  if (!now_s || !first_s_) return std::nullopt;
  return *now_s - *first_s_;
}

Expected<const VideoFrame*> CapturingReader::next() {
  try {
    if (!std::exchange(first_is_waiting_, false) && !read_next(announced_frames(), frames_per_s())) return nullptr;
    if (colour_.size() != size_ || colour_.depth() != CV_8U || (colour_.channels() != 3 && colour_.channels() != 1)) {
      return fail(path_ + ": a frame of another size or kind than the first");
    }
    if (colour_.channels() == 1) cv::cvtColor(colour_, colour_, cv::COLOR_GRAY2BGR);
    cv::extractChannel(colour_, grey_, 1);
    frame_ = {number_,
              {colour_.data, colour_.cols, colour_.rows, static_cast<std::ptrdiff_t>(colour_.step)},
              {grey_.data, grey_.cols, grey_.rows, static_cast<std::ptrdiff_t>(grey_.step)},
              time_since_first()};
    return &frame_;
  } catch (const std::exception& thrown) {
    return failed(path_, thrown);
  }
}

class EncodingWriter final : public VideoWriter {
 public:
  explicit EncodingWriter(std::string path) : path_(std::move(path)) {}
  [[nodiscard]] Expected<void> begin(int width, int height, double frames_per_s);
  [[nodiscard]] Expected<void> write(const VideoFrame& frame, const std::vector<VideoMark>& marks) override;
  [[nodiscard]] Expected<void> finish() override;

 private:
  std::string path_;
  cv::VideoWriter writer_;
  cv::Mat drawn_;
  std::uint64_t frames_ = 0;
};

Expected<void> EncodingWriter::begin(int width, int height, double frames_per_s) {
  constexpr double kUsualRate = 30.0;
  const double rate = is_plausible_rate(frames_per_s) ? frames_per_s : kUsualRate;
  if (!writer_.open(path_, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), rate, {width, height})) {
    return fail(path_ + ": can not be written; is the folder there, and does the name end in .mkv, .avi or .mov?");
  }
  return {};
}

Expected<void> EncodingWriter::write(const VideoFrame& frame, const std::vector<VideoMark>& marks) {
  try {
    // OpenCV takes no const data; what is borrowed here is only read.
    const ColourImage& colour = frame.colour;
    if (colour.bgr != nullptr && colour.width == frame.grey.width && colour.height == frame.grey.height) {
      cv::Mat(colour.height, colour.width, CV_8UC3, const_cast<std::uint8_t*>(colour.bgr),
              static_cast<std::size_t>(colour.stride))
          .copyTo(drawn_);
    } else {
      const cv::Mat grey(frame.grey.height, frame.grey.width, CV_8UC1, const_cast<std::uint8_t*>(frame.grey.data),
                         static_cast<std::size_t>(frame.grey.stride));
      cv::cvtColor(grey, drawn_, cv::COLOR_GRAY2BGR);
    }
    for (const VideoMark& mark : marks) {
      const cv::Scalar ink(mark.blue, mark.green, mark.red);
      constexpr int kFractionBits = 4;
      constexpr int kUnit = 1 << kFractionBits;
      const cv::Point at(static_cast<int>(std::lround(mark.u * kUnit)), static_cast<int>(std::lround(mark.v * kUnit)));
      cv::circle(drawn_, at, 5 * kUnit, ink, 1, cv::LINE_AA, kFractionBits);
      for (const cv::Point& arm : {cv::Point(2 * kUnit, 0), cv::Point(0, 2 * kUnit)}) {
        cv::line(drawn_, at - arm, at + arm, ink, 1, cv::LINE_AA, kFractionBits);
      }
    }
    writer_.write(drawn_);
    ++frames_;
    return {};
  } catch (const std::exception& thrown) {
    return failed(path_, thrown);
  }
}

Expected<void> EncodingWriter::finish() {
  const std::string cut = path_ + ": was not written whole: is the disk full?";
  try {
    writer_.release();
    // OpenCV says nothing of an error of the disk.
    cv::VideoCapture written(path_, cv::CAP_FFMPEG);
    const double last = static_cast<double>(frames_) - 1;
    if (!written.isOpened() || written.get(cv::CAP_PROP_FRAME_COUNT) < last) return fail(cut);
    cv::Mat frame;
    if (last > 0) written.set(cv::CAP_PROP_POS_FRAMES, last);
    if (!written.read(frame)) return fail(cut);
  } catch (const std::exception& thrown) {
    return failed(path_, thrown);
  }
  return {};
}

Expected<std::unique_ptr<VideoReader>> open(const std::string& path) {
  try {
    auto reader = std::make_unique<CapturingReader>(path);
    if (auto begun = reader->begin(); !begun) return tl::unexpected(std::move(begun.error()));
    return reader;
  } catch (const std::exception& thrown) {
    return failed(path, thrown);
  }
}

Expected<std::unique_ptr<VideoWriter>> create(const std::string& path, int width, int height, double frames_per_s) {
  try {
    auto writer = std::make_unique<EncodingWriter>(path);
    if (auto begun = writer->begin(width, height, frames_per_s); !begun)
      return tl::unexpected(std::move(begun.error()));
    return writer;
  } catch (const std::exception& thrown) {
    return failed(path, thrown);
  }
}

Expected<PictureFile> read_grey(const std::string& path) {
  try {
    // As the sensor has it, whichever way the camera was held.
    const cv::Mat grey = cv::imread(path, cv::IMREAD_GRAYSCALE | cv::IMREAD_IGNORE_ORIENTATION);
    if (grey.empty()) return fail(path + ": not a picture that can be read");
    PictureFile picture{grey.cols, grey.rows, {}};
    for (int y = 0; y < grey.rows; ++y) picture.grey.insert(picture.grey.end(), grey.ptr(y), grey.ptr(y) + grey.cols);
    return picture;
  } catch (const std::exception& thrown) {
    return failed(path, thrown);
  }
}

}  // namespace
}  // namespace perimap

const perimap::VideoModule* perimap_video_module() {
  static constexpr perimap::VideoModule kModule{&perimap::open, &perimap::create, &perimap::read_grey};
  perimap::keep_opencv_to_one_thread();
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);  // what is wrong is said here
  return &kModule;
}
