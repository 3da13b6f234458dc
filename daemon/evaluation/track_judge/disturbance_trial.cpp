#include "daemon/evaluation/track_judge/disturbance_trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/following/video_tracker.hpp"

namespace perimap {
namespace {

using Places = std::map<std::uint32_t, Vector2d>;

Places tracked(const VideoTracker& tracker) {
  Places places;
  for (const FollowedFeature& feature : tracker.features()) {
    if (feature.found && feature.state == FollowState::kTracked) places.emplace(feature.id, feature.px);
  }
  return places;
}

// Follows two versions of the clip, which are the same until the disturbance begins.
class Trial {
 public:
  Trial(int features, double frames_per_s)
      : pristine_({.features = features, .frames_per_s = frames_per_s}),
        disturbed_({.features = features, .frames_per_s = frames_per_s}) {}

  Expected<void> take_pristine(const VideoFrame& frame) { return take(pristine_, frame); }
  Expected<void> take_disturbed(const VideoFrame& frame) { return take(disturbed_, frame); }
  void begin() { begun_ = tracked(disturbed_); }

  // The picture is back, displaced by so much.
  void compare(const Vector2d& by, double right_px) {
    const Places truth = tracked(pristine_), found = tracked(disturbed_);
    truth_ = truth;
    for (const auto& [id, place] : begun_) {
      const auto is = found.find(id);
      const auto ought = truth.find(id);
      if (is == found.end() || ought == truth.end()) continue;
      const bool is_right = (is->second - ought->second - by).norm() <= right_px;
      (is_right ? right_ : wrong_).insert(id);
    }
  }

  // Of the features in view at the end.
  [[nodiscard]] DisturbanceFigures figures(const Vector2d& by, int width, int height) const {
    constexpr double kBorder = 0.05;
    const double border_px = kBorder * width;
    DisturbanceFigures figures;
    for (const auto& [id, place] : begun_) {
      const auto ought = truth_.find(id);
      if (ought == truth_.end()) continue;
      const Vector2d px = ought->second + by;
      if (px.x() < border_px || px.y() < border_px || px.x() > width - border_px || px.y() > height - border_px)
        continue;
      ++figures.features;
      figures.found += right_.contains(id) ? 1 : 0;
    }
    figures.wrong = wrong_.size();
    return figures;
  }

 private:
  static Expected<void> take(VideoTracker& tracker, const VideoFrame& frame) {
    tracker.track_into(frame.grey);
    return tracker.fill_up(frame.grey, frame.colour);
  }

  VideoTracker pristine_, disturbed_;
  Places begun_, truth_;
  std::set<std::uint32_t> right_, wrong_;
};

}  // namespace

Expected<DisturbanceFigures> try_disturbance(const std::function<VideoFrame(std::size_t)>& frame_at, std::size_t frames,
                                             double frames_per_s, int features, Disturbance disturbance,
                                             const DisturbanceLimits& limits) {
  constexpr double kUsualRate = 25;
  const double rate = frames_per_s > 0 ? frames_per_s : kUsualRate;
  const auto begin = static_cast<std::size_t>(std::lround(limits.begins_s * rate));
  const auto lasting = static_cast<std::size_t>(std::lround(seconds_of(disturbance) * rate));
  const std::size_t over = begin + lasting;
  const std::size_t end = over + static_cast<std::size_t>(std::lround(limits.found_within_s * rate));
  if (end > frames) {
    return fail(fmt::format("{} frames are too few for {}: {} are needed", frames, name_of(disturbance), end));
  }
  Trial trial(features, rate);
  DisturbedFrame composer;
  Vector2d by = Vector2d::Zero();
  int width = 0, height = 0;
  for (std::size_t step = 0; step < end; ++step) {
    const VideoFrame frame = frame_at(step);
    width = frame.grey.width;
    height = frame.grey.height;
    by = displacement_after(disturbance, width, height);
    if (step == begin) trial.begin();
    const double progress = (static_cast<double>(step) - static_cast<double>(begin)) / static_cast<double>(lasting);
    if (auto done = trial.take_pristine(frame); !done) return tl::unexpected(done.error());
    if (auto done = trial.take_disturbed(composer.compose(frame, disturbance, progress)); !done) {
      return tl::unexpected(done.error());
    }
    constexpr double kWidth = 1280, kLeast_px = 1.5;
    if (step >= over) trial.compare(by, std::max(kLeast_px, limits.right_px * width / kWidth));
  }
  DisturbanceFigures figures = trial.figures(by, width, height);
  figures.disturbance = disturbance;
  return figures;
}

Expected<std::vector<DisturbanceFigures>> try_disturbances(const Clip& clip, int features) {
  std::vector<DisturbanceFigures> all;
  for (const Disturbance disturbance : kDisturbances) {
    const auto frame_at = [&clip](std::size_t step) { return clip.at(step); };
    auto figures = try_disturbance(frame_at, clip.steps(), clip.frames_per_s(), features, disturbance);
    if (!figures) return tl::unexpected(figures.error());
    all.push_back(*figures);
  }
  return all;
}

std::string to_text(const std::vector<DisturbanceFigures>& all) {
  std::string text = fmt::format("{:<10} {:>9} {:>12} {:>6}\n", "", "features", "found again", "wrong");
  for (const DisturbanceFigures& of : all) {
    text += fmt::format("{:<10} {:>9} {:>12} {:>6}\n", name_of(of.disturbance), of.features, of.found, of.wrong);
  }
  return text;
}

nlohmann::json to_json(const std::vector<DisturbanceFigures>& all) {
  nlohmann::json events = nlohmann::json::array();
  for (const DisturbanceFigures& of : all) {
    events.push_back({{"event", name_of(of.disturbance)},
                      {"features", of.features},
                      {"found_again", of.found},
                      {"wrong", of.wrong}});
  }
  return {{"events", events}};
}

}  // namespace perimap
