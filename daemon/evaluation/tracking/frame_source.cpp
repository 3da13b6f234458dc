#include "daemon/evaluation/tracking/frame_source.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <optional>
#include <string_view>
#include <utility>

#include "core/statistics/upper_median.hpp"
#include "drivers/file/regular_file.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recorded_frame.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {
namespace {

class VideoSource final : public FrameSource {
 public:
  VideoSource(std::unique_ptr<VideoReader> reader, std::string path)
      : reader_(std::move(reader)), path_(std::move(path)) {}
  Expected<const VideoFrame*> next() override {
    auto frame = reader_->next();
    colour_ = frame && *frame != nullptr ? (*frame)->colour : ColourImage{};
    return frame;
  }
  [[nodiscard]] ColourImage colour() override { return colour_; }
  [[nodiscard]] std::uint64_t announced_frames() const override { return reader_->announced_frames(); }
  [[nodiscard]] double frames_per_s() const override { return reader_->frames_per_s(); }
  [[nodiscard]] std::vector<Error> damage() const override {
    if (!reader_->ends_early()) return {};
    return {{fmt::format("{}: announces {} frames and ends before: it may have been cut off", path_,
                         reader_->announced_frames())}};
  }

 private:
  std::unique_ptr<VideoReader> reader_;
  std::string path_;
  ColourImage colour_;
};

class RecordingSource final : public FrameSource {
 public:
  RecordingSource(RecordingReader reader, std::string path, double frames_per_s)
      : reader_(std::move(reader)), path_(std::move(path)), frames_per_s_(frames_per_s) {}

  // A frame that cannot be used is passed over; it keeps its number.
  Expected<const VideoFrame*> next() override {
    for (;; ++messages_) {
      auto message = reader_.next();
      if (!message) return tl::unexpected(message.error());
      if (!*message) return nullptr;
      auto image = recorded_.read(reader_, **message).and_then([this] { return recorded_.grey(); });
      if (image && frame_.grey.data != nullptr &&
          (image->width != frame_.grey.width || image->height != frame_.grey.height)) {
        image =
            fail(fmt::format("{}: byte {}: a frame of another size than the first", path_, (*message)->file_offset));
      }
      if (!image) {
        if (unusable_++ == 0) first_unusable_ = std::move(image.error());
        continue;
      }
      frame_.number = messages_++;
      frame_.grey = *image;
      return &frame_;
    }
  }
  [[nodiscard]] ColourImage colour() override { return recorded_.colour(); }
  [[nodiscard]] std::uint64_t announced_frames() const override { return 0; }
  [[nodiscard]] double frames_per_s() const override { return frames_per_s_; }
  [[nodiscard]] std::vector<Error> damage() const override {
    std::vector<Error> all = reader_.damage();
    if (unusable_ > 0) {
      all.push_back({fmt::format("{} frames passed over, the first: {}", unusable_, first_unusable_.message)});
    }
    return all;
  }

 private:
  RecordingReader reader_;
  std::string path_;
  double frames_per_s_;
  std::uint64_t messages_ = 0;
  std::uint64_t unusable_ = 0;
  Error first_unusable_;
  RecordedFrame recorded_{Duration(0)};
  VideoFrame frame_;
};

// By the middle one of the first intervals between the frames' captures; 0 with less than three frames. Leaves
// the recording at its first frame.
Expected<double> rate_of_frames(RecordingReader& recording) {
  constexpr std::size_t kFrames = 32;
  const auto start_over = [&] {
    const std::string_view channels[] = {channels::kCameraImage};
    return recording.select(channels);
  };
  if (const auto started = start_over(); !started) return tl::unexpected(started.error());
  std::vector<double> intervals_s;
  std::optional<Instant> before;
  while (intervals_s.size() < kFrames) {
    const auto message = recording.next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) break;
    if (before) intervals_s.push_back(to_seconds((*message)->source_time - *before));
    before = (*message)->source_time;
  }
  if (const auto started = start_over(); !started) return tl::unexpected(started.error());
  if (intervals_s.size() < 2) return 0.0;
  const double middle_s = upper_median(intervals_s.begin(), intervals_s.end());
  return middle_s > 0.0 ? 1.0 / middle_s : 0.0;
}

bool is_recording(const std::string& path) {
  constexpr std::string_view kMagic = "\x89MCAP";
  char start[kMagic.size()] = {};
  const auto opened = open_regular_file(path);
  if (!opened) return false;
  const ssize_t got = ::read(opened->get(), start, sizeof start);
  return got == ssize_t{sizeof start} && std::string_view(start, sizeof start) == kMagic;
}

}  // namespace

Expected<std::unique_ptr<FrameSource>> FrameSource::open(const std::string& path) {
  if (!is_recording(path)) {
    auto video = VideoReader::open(path);
    if (!video) return tl::unexpected(video.error());
    return std::make_unique<VideoSource>(*std::move(video), path);
  }
  // As of a video, what is whole is followed.
  auto recording = RecordingReader::open(path, ReadMode::kWhole);
  if (!recording) return tl::unexpected(recording.error());
  const auto rate = rate_of_frames(*recording);
  if (!rate) return tl::unexpected(rate.error());
  return std::make_unique<RecordingSource>(*std::move(recording), path, *rate);
}

}  // namespace perimap
