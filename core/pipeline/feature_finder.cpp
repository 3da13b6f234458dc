#include "core/pipeline/feature_finder.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/realtime/realtime_scope.hpp"

namespace perimap {
namespace {

// As wide as the search for a feature that has no map yet.
constexpr double kMotionDeviation_px = 10.0;

// Not all that is found lives through the round, least of all where the heart moves fastest; what is over is let go.
constexpr int with_spare(int wanted) { return 2 * wanted; }

}  // namespace

FeatureFinder::FeatureFinder(const PipelineSettings& settings, PipelineCounters& counters)
    : width_(settings.camera.width),
      height_(settings.camera.height),
      interval_(std::max(settings.features.detection_interval_frames, kFinderDelayFrames + 1)),
      lockstep_(settings.lockstep),
      counters_(counters),
      steps_(kFinderDelayFrames) {
  detector_.min_distance_px = settings.features.minimum_distance_px;
  for (Frame& frame : frames_) {
    frame.pixels.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  }
  occupied_.reserve(static_cast<std::size_t>(settings.features.maximum));
  found_.reserve(kMaximumPerRound);
}

void FeatureFinder::offer(std::uint64_t frame_index, const FrameStamp& stamp, const GreyImage& image,
                          std::span<const Vector2d> occupied, int wanted) noexcept {
  if (!active_) {
    if (wanted <= 0 || frame_index % static_cast<std::uint64_t>(interval_) != 0) return;
    active_ = true;
    begun_at_ = frame_index;
    // Relaxed: housekeeping sets it again only after it has popped this round's steps, and the ring orders that.
    done_.store(false, std::memory_order_relaxed);
    occupied_.assign(occupied.begin(), occupied.end());
    wanted_ = std::min(with_spare(wanted), static_cast<int>(kMaximumPerRound));
  }
  const std::uint64_t step = frame_index - begun_at_;
  if (step >= frames_.size()) return;
  Frame& frame = frames_[step];
  frame.stamp = stamp;
  for (int y = 0; y < height_; ++y) {
    std::memcpy(frame.pixels.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width_), image.row(y),
                static_cast<std::size_t>(width_));
  }
  if (steps_.push(static_cast<int>(step))) go_.post();
}

std::span<const FoundFeature> FeatureFinder::adopt(std::uint64_t frame_index) noexcept {
  if (!active_ || frame_index < begun_at_ + frames_.size()) return {};
  if (lockstep_) {
    const NamedWait wait;
    finished_.wait();
  }
  const bool due = frame_index == begun_at_ + frames_.size();
  // Acquire: what housekeeping found is visible once the flag is (pairs with the release in work()).
  if (!done_.load(std::memory_order_acquire)) {
    if (due) counters_.adoptions_late.add();
    return {};
  }
  active_ = false;
  // Late, the features have moved on and nobody followed them: the round is lost, the next one begins.
  const bool discarded = std::exchange(discarded_, false);
  const bool wanted = due && !discarded;
  return wanted ? std::span<const FoundFeature>(found_) : std::span<const FoundFeature>();
}

void FeatureFinder::serve() noexcept {
  for (;;) {
    go_.wait();
    if (dismissed_.load(std::memory_order_relaxed)) return;
    int step = 0;
    if (steps_.pop(step)) work(step);
  }
}

void FeatureFinder::dismiss() noexcept {
  dismissed_.store(true, std::memory_order_relaxed);
  go_.post();
}

void FeatureFinder::work(int step) noexcept {
  const Frame& frame = frames_[static_cast<std::size_t>(step)];
  if (step == 0) {
    find(frame);
  } else {
    follow(frame);
  }
  if (step + 1 < kFinderDelayFrames) return;
  // Release: found_ is complete before the mapper can see the flag.
  done_.store(true, std::memory_order_release);
  if (lockstep_) finished_.post();
}

void FeatureFinder::find(const Frame& frame) noexcept {
  found_.clear();
  const GreyImage image{frame.pixels.data(), width_, height_, width_};
  const auto corners = find_features(image, occupied_, detector_, wanted_);
  if (!corners) {
    counters_.searches_failed.add();
    return;
  }
  for (const Vector2d& px : *corners) {
    if (found_.size() == kMaximumPerRound) break;
    FoundFeature feature;
    if (make_patch_template(image, px, template_, tracker_.kernels(), feature.patch) != TemplateVerdict::kGood)
      continue;
    feature.first_observed = frame.stamp.capture;
    feature.first_observed_px = px;
    feature.patch_state.px = px;
    found_.push_back(feature);
  }
}

void FeatureFinder::follow(const Frame& frame) noexcept {
  const GreyImage image{frame.pixels.data(), width_, height_, width_};
  const Matrix2d covariance = kMotionDeviation_px * kMotionDeviation_px * Matrix2d::Identity();
  std::erase_if(found_, [&](FoundFeature& feature) {
    const PatchState last = feature.patch_state;
    const PatchMatch match =
        tracker_.track(image, feature.patch, feature.patch_state, last.px + feature.velocity_px, covariance);
    if (match.state != MatchState::kFound ||
        !feature.looks.is_plausible(last, feature.patch_state, match.correlation, 1)) {
      return true;
    }
    feature.looks.add(match.correlation);
    feature.velocity_px = match.px - last.px;
    return false;
  });
}

}  // namespace perimap
