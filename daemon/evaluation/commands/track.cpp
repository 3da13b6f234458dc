#include "daemon/evaluation/commands/track.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/statistics/upper_median.hpp"
#include "core/vision/confirmed_tracks.hpp"
#include "core/vision/feature_detector.hpp"
#include "core/vision/feature_follower.hpp"
#include "core/vision/instrument_mask.hpp"
#include "daemon/commands/progress.hpp"
#include "daemon/commands/same_file.hpp"
#include "daemon/process/stop_signal.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recorded_frame.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

constexpr int kOk = 0;
constexpr int kFailure = 1;
constexpr int kWrongUse = 2;

struct Options {
  std::string input;
  std::string csv;
  std::string video;
  int features = 200;
  bool no_new_features = false;
};

// Frames one by one, from a video or a recording.
class FrameSource {
 public:
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
  RecordedFrame recorded_{1};
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
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  return file != nullptr && std::fread(start, 1, sizeof start, file.get()) == sizeof start &&
         std::string_view(start, sizeof start) == kMagic;
}

Expected<std::unique_ptr<FrameSource>> open_source(const std::string& path) {
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

// The tracks as text, in a file beside the one it will become; straight into what is there and no file (a pipe, a
// device).
class TrackTable {
 public:
  static Expected<TrackTable> create(const std::string& path) {
    TrackTable table(path);
    table.file_.reset(std::fopen(table.partial_.c_str(), "w"));
    if (table.file_ == nullptr) return fail(path + ": can not be written");
    fmt::print(table.file_.get(), "frame,id,x,y,state\n");
    return table;
  }

  TrackTable(TrackTable&&) = default;
  TrackTable& operator=(TrackTable&&) = delete;
  TrackTable(const TrackTable&) = delete;
  TrackTable& operator=(const TrackTable&) = delete;
  ~TrackTable() {
    if (file_ == nullptr || partial_ == path_) return;
    file_.reset();
    std::error_code ignored;
    std::filesystem::remove(partial_, ignored);
  }

  void write(std::span<const TrackRow> rows) {
    for (const TrackRow& row : rows) {
      fmt::print(file_.get(), "{},{},{:.3f},{:.3f},{}\n", row.frame, row.id, row.px.x(), row.px.y(),
                 row.is_candidate ? "candidate" : "tracked");
    }
    rows_ += rows.size();
  }
  [[nodiscard]] std::size_t rows() const noexcept { return rows_; }

  Expected<void> finish() {
    std::error_code error;
    if (std::ferror(file_.get()) != 0 || std::fflush(file_.get()) != 0) {
      return fail(path_ + ": could not be written whole");
    }
    if (partial_ != path_) std::filesystem::rename(partial_, path_, error);
    if (error) return fail(path_ + ": " + error.message());
    file_.reset();
    return {};
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const noexcept { (void)std::fclose(file); }
  };
  explicit TrackTable(const std::string& path) : path_(path), partial_(is_special(path) ? path : path + ".part") {}
  std::string path_, partial_;
  std::unique_ptr<std::FILE, Close> file_;
  std::size_t rows_ = 0;
};

VideoMark mark_of(const FollowedFeature& feature) noexcept {
  VideoMark mark{feature.px.x(), feature.px.y()};
  switch (feature.state) {
    case FollowState::kTracked:
      mark.green = 255;
      break;
    case FollowState::kCandidate:
      mark.green = mark.red = 255;
      break;
    case FollowState::kOccluded:
    case FollowState::kEmpty:
      mark.red = 255;
      mark.blue = 160;
      break;
  }
  return mark;
}

struct Summary {
  std::uint64_t frames = 0;
  std::uint64_t poor_frames = 0;  // in which fewer than a tenth of the features wanted were found
  double follow_s = 0;
};

class Tracking {
 public:
  Tracking(const Options& options, double frames_per_s)
      : options_(options),
        find_interval_(settings(options, frames_per_s).rate.frames(std::chrono::milliseconds(167))),
        follower_(settings(options, frames_per_s)) {}

  // Follows every feature in the frame and fills up their number every sixth of a second.
  Expected<void> take(const VideoFrame& frame, FrameSource& source) {
    const auto begin = std::chrono::steady_clock::now();
    follower_.track_into(frame.grey);
    summary_.follow_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const bool may_find =
        follower_.saw_anything() && (options_.no_new_features ? !has_found_ : summary_.frames % find_interval_ == 0);
    ++summary_.frames;
    if (may_find && follower_.free() > 0) {
      if (auto done = find(frame.grey, source.colour()); !done) return done;
    }
    constexpr int kPoor = 10;  // one in so many
    const auto found = std::count_if(follower_.features().begin(), follower_.features().end(),
                                     [](const FollowedFeature& feature) { return feature.found; });
    summary_.poor_frames += kPoor * found < options_.features ? 1 : 0;
    return {};
  }

  [[nodiscard]] std::span<const FollowedFeature> features() const noexcept { return follower_.features(); }

  [[nodiscard]] std::vector<VideoMark> marks() const {
    std::vector<VideoMark> marks;
    for (const FollowedFeature& feature : follower_.features()) {
      if (feature.state != FollowState::kEmpty) marks.push_back(mark_of(feature));
    }
    return marks;
  }

  [[nodiscard]] const Summary& summary() const noexcept { return summary_; }
  [[nodiscard]] std::size_t frames_to_judge() const noexcept { return follower_.frames_to_judge(); }

 private:
  static FollowerSettings settings(const Options& options, double frames_per_s) {
    FollowerSettings settings;
    settings.maximum = options.features;
    if (frames_per_s > 0) settings.rate = FrameRate(frames_per_s);
    return settings;
  }

  Expected<void> find(const GreyImage& image, const ColourImage& colour) {
    const std::vector<Vector2d> occupied = follower_.occupied();
    GreyImage barred;
    std::vector<std::uint8_t> mask;
    if (colour.bgr != nullptr) {
      auto instruments = find_instruments(colour, image.width, image.height);
      if (!instruments) return tl::unexpected(instruments.error());
      mask = *std::move(instruments);
      barred = {mask.data(), image.width, image.height, image.width};
    }
    const DetectorSettings detector = detector_settings_for(image, options_.features);
    const auto corners = find_features(image, occupied, detector, follower_.free(), barred);
    if (!corners) return tl::unexpected(corners.error());
    follower_.add(image, *corners, template_settings_for(detector));
    has_found_ = has_found_ || !corners->empty();
    return {};
  }

  const Options& options_;
  std::uint64_t find_interval_;  // frames
  FeatureFollower follower_;
  bool has_found_ = false;
  Summary summary_;
};

int refuse(const Error& error, int code) {
  fmt::print(stderr, "perimap track: {}\n", error.message);
  return code;
}

// What is read must not be written over.
Expected<void> check_outputs(const Options& options) {
  if (is_same_file(options.csv, options.input)) return fail("--csv: is INPUT itself");
  if (options.video.empty()) return {};
  if (is_same_file(options.video, options.input)) return fail("--video: is INPUT itself");
  if (is_same_file(options.video, options.csv)) return fail("--video: is the file of --csv");
  return {};
}

int track(const Options& options) {
  if (const auto apart = check_outputs(options); !apart) return refuse(apart.error(), kWrongUse);
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error(), kFailure);
  auto source = open_source(options.input);
  if (!source) return refuse(source.error(), kFailure);
  auto table = TrackTable::create(options.csv);
  if (!table) return refuse(table.error(), kFailure);
  std::unique_ptr<VideoWriter> video;
  Tracking tracking(options, (*source)->frames_per_s());
  ConfirmedTracks tracks(tracking.frames_to_judge());
  std::optional<Error> broken;  // ends the reading; what was found until then is written
  {
    Progress progress("frames", (*source)->announced_frames());
    while (!stop->requested()) {
      const auto frame = (*source)->next();
      if (!frame) {
        broken = frame.error();
        break;
      }
      if (*frame == nullptr) break;
      if (const auto taken = tracking.take(**frame, **source); !taken) return refuse(taken.error(), kFailure);
      table->write(tracks.add((*frame)->number, tracking.features()));
      if (!options.video.empty()) {
        if (!video) {
          const GreyImage& grey = (*frame)->grey;
          auto created = VideoWriter::create(options.video, grey.width, grey.height, (*source)->frames_per_s());
          if (!created) return refuse(created.error(), kFailure);
          video = *std::move(created);
        }
        if (const auto written = video->write(**frame, tracking.marks()); !written) {
          return refuse(written.error(), kFailure);
        }
      }
      if ((*source)->announced_frames() > 0) progress.update(tracking.summary().frames);
    }
  }
  table->write(tracks.finish());
  if (const auto finished = table->finish(); !finished) return refuse(finished.error(), kFailure);
  if (video) {
    if (const auto finished = video->finish(); !finished) return refuse(finished.error(), kFailure);
  }
  const Summary& summary = tracking.summary();
  if (!stop->requested()) {
    for (const Error& damage : (*source)->damage()) fmt::print(stderr, "perimap track: {}\n", damage.message);
  }
  if (2 * summary.poor_frames > summary.frames || table->rows() == 0) {
    fmt::print(stderr,
               "perimap track: {}: hardly any features could be found: too dark, too blurred or without texture?\n",
               options.input);
  }
  if (summary.poor_frames > 0) {
    fmt::print(stderr, "perimap track: {}: in {} of {} frames fewer than a tenth of {} features were found\n",
               options.input, summary.poor_frames, summary.frames, options.features);
  }
  const double frames = static_cast<double>(std::max<std::uint64_t>(summary.frames, 1));
  fmt::print("{}{} frames, {:.1f} features a frame, {:.2f} ms a frame to follow them: {}\n",
             stop->requested() ? "stopped early: " : "", summary.frames, static_cast<double>(table->rows()) / frames,
             1e3 * summary.follow_s / frames, options.csv);
  return broken ? refuse(*broken, kFailure) : kOk;
}

}  // namespace

void add_track_command(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "track",
      "Follow features through a video or the frames of a recording by their looks alone, without map or pose");
  auto options = std::make_shared<Options>();
  command->add_option("INPUT", options->input, "A video file, or a recording (MCAP)")->required();
  command
      ->add_option(
          "--csv", options->csv,
          "Where to write the tracks: frame,id,x,y,state; a row a feature a frame in which it is found. Frames\n"
          "count from 0, pixels from the centre of the first; states are candidate and tracked. A candidate that is\n"
          "never tracked has no rows")
      ->required();
  command->add_option("--video", options->video, "Where to write the frames with their features marked (.mkv, .avi)");
  command->add_option("--features", options->features, "How many are kept followed")
      ->check(CLI::Range(1, 5000))
      ->capture_default_str();
  command->add_flag("--no-new-features", options->no_new_features,
                    "Only those found in the first frame that shows any");
  command->footer(
      "Prediction: each feature by its own velocity; where that fails by the motion of the features around it; where\n"
      "most fail at once, a wide search. A recording's tracker and ECG are not used. What stands still while the\n"
      "camera moves (text, a logo) is let go.\n"
      "Exit codes: 0 done, 1 failed, 2 wrong usage.");
  command->callback([options, &exit_code] { exit_code = track(*options); });
}

}  // namespace perimap
