#include "daemon/evaluation/tracking/followed_video.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <span>
#include <utility>

#include "core/following/confirmed_tracks.hpp"
#include "core/following/feature_follower.hpp"
#include "core/following/video_tracker.hpp"
#include "daemon/evaluation/tracking/frame_source.hpp"
#include "daemon/evaluation/tracking/track_table.hpp"
#include "drivers/file/output_file.hpp"
#include "drivers/file/whole_file.hpp"
#include "drivers/video/video_file.hpp"

namespace perimap {
namespace {

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

struct Counts {
  std::uint64_t frames = 0;
  std::uint64_t poor_frames = 0;
  double follow_s = 0;
};

// The tracker, and what is counted of it.
class Tracking {
 public:
  Tracking(const FollowSettings& options, double frames_per_s)
      : options_(options),
        tracker_({.features = options.features,
                  .first_features_alone = options.first_features_alone,
                  .frames_per_s = frames_per_s}) {}

  // Follows every feature in the frame and fills up their number.
  Expected<void> track(const VideoFrame& frame, FrameSource& source) {
    const auto begin = std::chrono::steady_clock::now();
    tracker_.track_into(frame.grey);
    counts_.follow_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    ++counts_.frames;
    if (auto done = tracker_.fill_up(frame.grey, source.colour()); !done) return done;
    constexpr int kPoor = 10;  // one in so many
    const auto found = std::count_if(tracker_.features().begin(), tracker_.features().end(),
                                     [](const FollowedFeature& feature) { return feature.found; });
    counts_.poor_frames += kPoor * found < options_.features ? 1 : 0;
    return {};
  }

  [[nodiscard]] std::span<const FollowedFeature> features() const noexcept { return tracker_.features(); }

  [[nodiscard]] std::vector<VideoMark> marks() const {
    std::vector<VideoMark> marks;
    for (const FollowedFeature& feature : tracker_.features()) {
      if (feature.state != FollowState::kEmpty) marks.push_back(mark_of(feature));
    }
    return marks;
  }

  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }
  [[nodiscard]] std::size_t frames_to_judge() const noexcept { return tracker_.frames_to_judge(); }

 private:
  FollowSettings options_;
  VideoTracker tracker_;
  Counts counts_;
};

// The frames with their features marked, from the first frame on.
class MarkedVideo {
 public:
  MarkedVideo(std::string path, double frames_per_s) : path_(std::move(path)), frames_per_s_(frames_per_s) {}

  Expected<void> write(const VideoFrame& frame, const std::vector<VideoMark>& marks) {
    if (path_.empty()) return {};
    if (!writer_) {
      auto whole = WholeFile::create(path_, WholeFile::Name::kPartWithEnding);
      if (!whole) return tl::unexpected(whole.error());
      // The writer would open a pipe that nobody reads from for ever; and the reader of one is to find it open.
      const auto opened = open_output_file(whole->path());
      if (!opened) return fail(path_ + ": cannot be written: " + opened.error());
      auto writer = VideoWriter::create(whole->path().string(), frame.grey.width, frame.grey.height, frames_per_s_);
      if (!writer) return told(std::move(writer.error()), whole->path());
      whole_.emplace(std::move(*whole));
      writer_ = *std::move(writer);
    }
    auto written = writer_->write(frame, marks);
    if (!written) return told(std::move(written.error()), whole_->path());
    return written;
  }

  Expected<void> finish() {
    if (!writer_) return {};
    if (auto done = writer_->finish(); !done) return told(std::move(done.error()), whole_->path());
    writer_.reset();
    return whole_->finish();
  }

 private:
  // The writer knows the file by its other name alone.
  [[nodiscard]] tl::unexpected<Error> told(Error error, const std::filesystem::path& partial) const {
    const std::string other = partial.string();
    if (error.message.starts_with(other)) error.message.replace(0, other.size(), path_);
    return tl::unexpected(std::move(error));
  }

  std::string path_;
  double frames_per_s_;
  std::optional<WholeFile> whole_;  // goes after what writes to it
  std::unique_ptr<VideoWriter> writer_;
};

}  // namespace

Expected<FollowSummary> follow_features(const FollowSettings& settings, StopSignal& stop,
                                        const std::function<void(std::uint64_t frames, std::uint64_t all)>& progress) {
  auto source = FrameSource::open(settings.input);
  if (!source) return tl::unexpected(source.error());
  auto table = TrackTable::create(settings.table);
  if (!table) return tl::unexpected(table.error());
  MarkedVideo video(settings.video, (*source)->frames_per_s());
  Tracking tracking(settings, (*source)->frames_per_s());
  ConfirmedTracks tracks(tracking.frames_to_judge());
  FollowSummary summary;
  while (!stop.requested()) {
    const auto frame = (*source)->next();
    if (!frame) {
      summary.broken = frame.error();
      break;
    }
    if (*frame == nullptr) break;
    if (const auto taken = tracking.track(**frame, **source); !taken) return tl::unexpected(taken.error());
    table->write(tracks.add((*frame)->number, tracking.features()));
    if (const auto written = video.write(**frame, tracking.marks()); !written) return tl::unexpected(written.error());
    progress(tracking.counts().frames, (*source)->announced_frames());
  }
  summary.stopped = stop.requested();
  table->write(tracks.finish());
  if (const auto finished = table->finish(); !finished) return tl::unexpected(finished.error());
  if (const auto finished = video.finish(); !finished) return tl::unexpected(finished.error());
  summary.frames = tracking.counts().frames;
  summary.poor_frames = tracking.counts().poor_frames;
  summary.follow_s = tracking.counts().follow_s;
  summary.rows = table->rows();
  if (!summary.stopped) summary.damage = (*source)->damage();
  return summary;
}

std::vector<std::string> warnings(const FollowSummary& summary, const FollowSettings& settings) {
  std::vector<std::string> told;
  if (2 * summary.poor_frames > summary.frames || summary.rows == 0) {
    told.push_back(settings.input + ": hardly any features could be found: too dark, too blurred or without texture?");
  }
  if (summary.poor_frames > 0) {
    told.push_back(fmt::format("{}: in {} of {} frames fewer than a tenth of {} features were found", settings.input,
                               summary.poor_frames, summary.frames, settings.features));
  }
  return told;
}

std::string to_text(const FollowSummary& summary, const FollowSettings& settings) {
  const double frames = static_cast<double>(std::max<std::uint64_t>(summary.frames, 1));
  return fmt::format("{}{} frames, {:.1f} features a frame, {:.2f} ms a frame to follow them: {}\n",
                     summary.stopped ? "stopped early: " : "", summary.frames,
                     static_cast<double>(summary.rows) / frames, 1e3 * summary.follow_s / frames, settings.table);
}

}  // namespace perimap
