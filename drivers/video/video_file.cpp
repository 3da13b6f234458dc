#include "drivers/video/video_file.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace perimap {
namespace {

// What OpenCV throws has several lines.
tl::unexpected<Error> failed(const std::string& path, const std::exception& error) {
  std::string what = error.what();
  std::replace(what.begin(), what.end(), '\n', ' ');
  return fail(path + ": " + what);
}

bool is_plausible_rate(double frames_per_s) noexcept { return frames_per_s > 0.1 && frames_per_s < 2000; }

}  // namespace

struct VideoReader::Impl {
  std::string path;
  cv::VideoCapture capture;
  cv::Mat colour, grey;
  cv::Size size;
  bool first_is_waiting = true;
  std::uint64_t number = 0;
  double time_ms = 0;                // of the last frame that had one
  std::uint64_t frames_untimed = 0;  // since
  bool is_broken = false;
  VideoFrame frame;

  [[nodiscard]] bool read() { return capture.read(colour) && !colour.empty(); }
  [[nodiscard]] bool read_next(std::uint64_t announced, double frames_per_s);
};

bool VideoReader::Impl::read_next(std::uint64_t announced, double frames_per_s) {
  constexpr int kMostFailures = 300;  // in a row
  int failures = 0;
  while (!read()) {
    if (number + 1 >= announced || ++failures > kMostFailures) return false;
  }
  is_broken = is_broken || failures > 0;
  ++number;
  // Beyond a broken spot decoders leave out more frames without a word. Some that they give have no time: 0.
  const double now_ms = capture.get(cv::CAP_PROP_POS_MSEC);
  const bool is_timed = now_ms > 0 && time_ms > 0;
  const double before_ms = time_ms;
  const std::uint64_t untimed = std::exchange(frames_untimed, now_ms > 0 ? 0 : frames_untimed + 1);
  if (now_ms > 0) time_ms = now_ms;
  if (is_broken && is_timed && number < announced) {
    const double missing = std::round(1e-3 * (now_ms - before_ms) * frames_per_s) - 1 - static_cast<double>(untimed);
    number += static_cast<std::uint64_t>(std::clamp(missing, 0.0, static_cast<double>(announced - 1 - number)));
  }
  return true;
}

VideoReader::VideoReader(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
VideoReader::VideoReader(VideoReader&&) noexcept = default;
VideoReader::~VideoReader() = default;

Expected<VideoReader> VideoReader::open(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return fail(path + ": there is no such file");
  if (!std::filesystem::is_regular_file(path, error)) return fail(path + ": a folder or a device, not a video file");
  try {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);  // what is wrong is said here
    auto impl = std::make_unique<Impl>();
    impl->path = path;
    if (!impl->capture.open(path, cv::CAP_FFMPEG)) return fail(path + ": not a video that can be read");
    if (!impl->read()) {
      return fail(path + ": the first frame can not be decoded");
    }
    impl->size = impl->colour.size();
    return VideoReader(std::move(impl));
  } catch (const std::exception& thrown) {
    return failed(path, thrown);
  }
}

std::uint64_t VideoReader::announced_frames() const noexcept {
  const double count = impl_->capture.get(cv::CAP_PROP_FRAME_COUNT);
  return count > 0 && count < 1e12 ? static_cast<std::uint64_t>(count) : 0;
}

double VideoReader::frames_per_s() const noexcept {
  const double rate = impl_->capture.get(cv::CAP_PROP_FPS);
  return is_plausible_rate(rate) ? rate : 0;
}

bool VideoReader::ends_early() const noexcept {
  // Containers round: a frame less is none that is missing, nor is one at a rate that changes.
  constexpr double kMargin = 0.02, kMargin_frames = 2;
  const auto announced = static_cast<double>(announced_frames());
  const double rate = frames_per_s();
  const auto last = static_cast<double>(impl_->number);
  if (last + kMargin_frames >= announced) return false;
  const double reached = rate > 0 && impl_->time_ms > 0 ? 1e-3 * impl_->time_ms * rate : last;
  return reached + kMargin_frames < (1 - kMargin) * announced;
}

Expected<const VideoFrame*> VideoReader::next() {
  try {
    if (!std::exchange(impl_->first_is_waiting, false) && !impl_->read_next(announced_frames(), frames_per_s())) {
      return nullptr;
    }
    cv::Mat& colour = impl_->colour;
    if (colour.size() != impl_->size || colour.depth() != CV_8U || (colour.channels() != 3 && colour.channels() != 1)) {
      return fail(impl_->path + ": a frame of another size or kind than the first");
    }
    if (colour.channels() == 1) cv::cvtColor(colour, colour, cv::COLOR_GRAY2BGR);
    cv::extractChannel(colour, impl_->grey, 1);
    const cv::Mat& grey = impl_->grey;
    impl_->frame = {impl_->number,
                    {colour.data, colour.cols, colour.rows, static_cast<std::ptrdiff_t>(colour.step)},
                    {grey.data, grey.cols, grey.rows, static_cast<std::ptrdiff_t>(grey.step)}};
    return &impl_->frame;
  } catch (const std::exception& thrown) {
    return failed(impl_->path, thrown);
  }
}

struct VideoWriter::Impl {
  std::string path;
  cv::VideoWriter writer;
  cv::Mat drawn;
  std::uint64_t frames = 0;
};

VideoWriter::VideoWriter(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
VideoWriter::VideoWriter(VideoWriter&&) noexcept = default;
VideoWriter::~VideoWriter() = default;

Expected<VideoWriter> VideoWriter::create(const std::string& path, int width, int height, double frames_per_s) {
  try {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    auto impl = std::make_unique<Impl>();
    impl->path = path;
    constexpr double kUsualRate = 30.0;
    const double rate = is_plausible_rate(frames_per_s) ? frames_per_s : kUsualRate;
    if (!impl->writer.open(path, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), rate, {width, height})) {
      return fail(path + ": can not be written; is the folder there, and does the name end in .mkv, .avi or .mov?");
    }
    return VideoWriter(std::move(impl));
  } catch (const std::exception& thrown) {
    return failed(path, thrown);
  }
}

Expected<void> VideoWriter::write(const VideoFrame& frame, const std::vector<VideoMark>& marks) {
  try {
    // OpenCV takes no const data; what is borrowed here is only read.
    const ColourImage& colour = frame.colour;
    if (colour.bgr != nullptr && colour.width == frame.grey.width && colour.height == frame.grey.height) {
      cv::Mat(colour.height, colour.width, CV_8UC3, const_cast<std::uint8_t*>(colour.bgr),
              static_cast<std::size_t>(colour.stride))
          .copyTo(impl_->drawn);
    } else {
      const cv::Mat grey(frame.grey.height, frame.grey.width, CV_8UC1, const_cast<std::uint8_t*>(frame.grey.data),
                         static_cast<std::size_t>(frame.grey.stride));
      cv::cvtColor(grey, impl_->drawn, cv::COLOR_GRAY2BGR);
    }
    for (const VideoMark& mark : marks) {
      const cv::Scalar ink(mark.blue, mark.green, mark.red);
      constexpr int kFractionBits = 4;
      constexpr int kUnit = 1 << kFractionBits;
      const cv::Point at(static_cast<int>(std::lround(mark.u * kUnit)), static_cast<int>(std::lround(mark.v * kUnit)));
      cv::circle(impl_->drawn, at, 5 * kUnit, ink, 1, cv::LINE_AA, kFractionBits);
      for (const cv::Point& arm : {cv::Point(2 * kUnit, 0), cv::Point(0, 2 * kUnit)}) {
        cv::line(impl_->drawn, at - arm, at + arm, ink, 1, cv::LINE_AA, kFractionBits);
      }
    }
    impl_->writer.write(impl_->drawn);
    ++impl_->frames;
    return {};
  } catch (const std::exception& thrown) {
    return failed(impl_->path, thrown);
  }
}

Expected<void> VideoWriter::finish() {
  const std::string cut = impl_->path + ": was not written whole: is the disk full?";
  try {
    impl_->writer.release();
    // OpenCV says nothing of an error of the disk.
    cv::VideoCapture written(impl_->path, cv::CAP_FFMPEG);
    const double last = static_cast<double>(impl_->frames) - 1;
    if (!written.isOpened() || written.get(cv::CAP_PROP_FRAME_COUNT) < last) return fail(cut);
    cv::Mat frame;
    if (last > 0) written.set(cv::CAP_PROP_POS_FRAMES, last);
    if (!written.read(frame)) return fail(cut);
  } catch (const std::exception& thrown) {
    return failed(impl_->path, thrown);
  }
  return {};
}

}  // namespace perimap
