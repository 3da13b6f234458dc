#include "core/pipeline/feature_finder.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>

#include "core/geometry/symmetric_matrix2.hpp"
#include "core/pipeline/unmapped_motion.hpp"
#include "core/realtime/realtime_scope.hpp"
#include "core/vision/feature_detector.hpp"
#include "core/vision/instrument_mask.hpp"

namespace perimap {
namespace {

constexpr Duration kTakenEvery = std::chrono::microseconds(33333);

// Not all that is found lives through the round, least of all where the heart moves fastest; what is over is let go.
constexpr std::size_t with_spare(std::size_t wanted) { return 2 * wanted; }

// As many as may be followed are not all to lie where the scope looks first: so far apart that a picture full of tissue
// takes 120, or as many as there may be where those are fewer, and what comes into view takes the others.
double spread_px(const PipelineSettings& settings) noexcept {
  constexpr double kOfEvenSpacing = 0.63;
  constexpr int kInOnePicture = 120;
  const double pixels = static_cast<double>(settings.camera.width) * settings.camera.height;
  return kOfEvenSpacing * std::sqrt(pixels / std::min(settings.features.maximum, kInOnePicture));
}

}  // namespace

FeatureFinder::FeatureFinder(const PipelineSettings& settings, PipelineCounters& counters)
    : width_(settings.camera.width),
      height_(settings.camera.height),
      bands_(bands_of(width_, height_)),
      interval_(settings.features.detection_interval),
      lockstep_(settings.lockstep),
      min_distance_px_(std::max(settings.features.minimum_distance_px, spread_px(settings))),
      maximum_(settings.features.maximum),
      share_(static_cast<std::size_t>((maximum_ + bands_ - 1) / bands_)),
      counters_(counters),
      steps_(kFinderFrames) {
  for (Frame& frame : frames_) {
    frame.pixels.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  }
  bgr_.resize(reduced_row_bytes(width_) * static_cast<std::size_t>(reduced_side(height_)));
  occupied_.reserve(static_cast<std::size_t>(settings.features.maximum));
  in_bands_.resize(static_cast<std::size_t>(bands_), 0);
  gave_.resize(static_cast<std::size_t>(bands_), true);
  found_.reserve(kMaximumPerRound);
}

bool FeatureFinder::may_begin(std::uint64_t frame_index, const FrameRate& rate, const ColourImage& colour) noexcept {
  // Not every frame of a colour camera comes with colour; and one may have none any more, or lose just those frames.
  constexpr Duration kColourAwaited = std::chrono::seconds(2);
  const bool coloured = colour.bgr != nullptr;
  if (coloured) colour_until_ = frame_index + rate.frames(kColourAwaited);
  return frame_index >= next_round_at_ && (coloured || frame_index >= colour_until_);
}

int FeatureFinder::next_band() noexcept {
  std::fill(in_bands_.begin(), in_bands_.end(), 0);
  for (const Vector2d& px : occupied_) {
    ++in_bands_[static_cast<std::size_t>(band_of_row(height_, static_cast<int>(px.y()), bands_))];
  }
  const auto has_room = [this](int band) { return in_bands_[static_cast<std::size_t>(band)] < share_; };
  bool any = false;
  for (int band = 0; band < bands_; ++band) any = any || (has_room(band) && gave_[static_cast<std::size_t>(band)]);
  int next = (band_ + 1) % bands_;
  while (any && !has_room(next)) next = (next + 1) % bands_;
  return next;
}

void FeatureFinder::offer(std::uint64_t frame_index, const FrameStamp& stamp, const FrameRate& rate,
                          const GreyImage& image, const ColourImage& colour, std::span<const Vector2d> occupied,
                          int wanted) noexcept {
  const bool may = may_begin(frame_index, rate, colour);
  if (!active_) {
    if (wanted <= 0 || !may) return;
    active_ = true;
    begun_at_ = frame_index;
    stride_ = rate.frames(kTakenEvery);
    stride_s_ = static_cast<double>(stride_) / rate.per_s();
    const auto bands = static_cast<std::uint64_t>(bands_);
    next_round_at_ = std::max(frame_index + rate.frames(interval_) / bands, adopted_at() + 1);
    // Relaxed: housekeeping sets it again only after it has popped this round's steps, and the ring orders that.
    done_.store(false, std::memory_order_relaxed);
    occupied_.assign(occupied.begin(), occupied.end());
    wanted_ = std::min(static_cast<std::size_t>(wanted), share_);
    tried_ = std::min(with_spare(wanted_), kMaximumPerRound);
    band_ = next_band();
    coloured_ = colour.bgr != nullptr;
    const std::size_t row_bytes = reduced_row_bytes(width_);
    for (std::size_t y = 0; coloured_ && y < static_cast<std::size_t>(reduced_side(height_)); ++y) {
      std::memcpy(bgr_.data() + y * row_bytes, colour.row(static_cast<int>(y)), row_bytes);
    }
  }
  const std::uint64_t step = (frame_index - begun_at_) / stride_;
  if (step >= frames_.size() || (frame_index - begun_at_) % stride_ != 0) return;
  Frame& frame = frames_[step];
  frame.stamp = stamp;
  for (int y = 0; y < height_; ++y) {
    std::memcpy(frame.pixels.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width_), image.row(y),
                static_cast<std::size_t>(width_));
  }
  if (steps_.push(static_cast<int>(step))) go_.post();
}

std::span<const FoundFeature> FeatureFinder::adopt(std::uint64_t frame_index) noexcept {
  if (!active_ || frame_index < adopted_at()) return {};
  if (lockstep_) {
    const NamedWait wait;
    finished_.wait();
  }
  const bool due = frame_index == adopted_at();
  // Acquire: what housekeeping found is visible once the flag is (pairs with the release in work()).
  if (!done_.load(std::memory_order_acquire)) {
    if (due) counters_.adoptions_late.add();
    return {};
  }
  active_ = false;
  adopted_templates_ = templates_;
  // Late, the features have moved on and nobody followed them: the round is lost, the next one begins.
  const bool discarded = std::exchange(discarded_, false);
  if (due) gave_[static_cast<std::size_t>(band_)] = !found_.empty();
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
  const auto number = static_cast<std::size_t>(step);
  const Frame& frame = frames_[number];
  if (step == 0) {
    find(frame);
  } else {
    track_candidates(frame, frames_[number - 1]);
  }
  if (step + 1 < kFinderFrames) return;
  put_the_surest_first();
  for (FoundFeature& feature : found_) feature.velocity_px /= static_cast<double>(stride_);
  // Release: found_ is complete before the mapper can see the flag.
  done_.store(true, std::memory_order_release);
  if (lockstep_) finished_.post();
}

Expected<std::vector<std::uint8_t>> FeatureFinder::instruments() const {
  if (!coloured_) return std::vector<std::uint8_t>{};
  const auto stride = static_cast<std::ptrdiff_t>(reduced_row_bytes(width_));
  return find_instruments({bgr_.data(), reduced_side(width_), reduced_side(height_), stride}, width_, height_);
}

void FeatureFinder::find(const Frame& frame) noexcept {
  found_.clear();
  const GreyImage image = image_of(frame);
  const auto mask = instruments();
  if (!mask) {
    counters_.searches_failed.add();
    return;
  }
  const GreyImage barred = mask->empty() ? GreyImage{} : GreyImage{mask->data(), width_, height_, width_};
  DetectorSettings detector = detector_settings_for(image, maximum_);
  detector.min_distance_px = min_distance_px_;
  templates_ = template_settings_for(detector);
  if (!add_corners(frame, detector, barred) || found_.size() >= tried_) return;
  detector = detector_settings_for_trial(image, maximum_);
  detector.min_distance_px = min_distance_px_;
  static_cast<void>(add_corners(frame, detector, barred));
}

// As many as are still to be tried. False when the search failed.
bool FeatureFinder::add_corners(const Frame& frame, const DetectorSettings& detector, const GreyImage& barred) {
  const GreyImage image = image_of(frame);
  std::vector<Vector2d> taken = occupied_;
  for (const FoundFeature& feature : found_) taken.push_back(feature.first_observed_px);
  const auto corners = find_features(image, taken, detector, static_cast<int>(tried_ - found_.size()), barred,
                                     rows_of_band(height_, band_, bands_));
  if (!corners) {
    counters_.searches_failed.add();
    return false;
  }
  const TemplateSettings templates = template_settings_for(detector);
  for (const Vector2d& px : *corners) {
    FoundFeature feature;
    if (make_patch_template(image, px, templates, tracker_.kernels(), feature.patch) != TemplateVerdict::kGood)
      continue;
    feature.first_observed = frame.stamp.capture;
    feature.first_observed_px = px;
    feature.patch_state.px = px;
    found_.push_back(feature);
  }
  return true;
}

// As later in its life: by its first view, or as it looked in the frame before.
PatchMatch FeatureFinder::find_candidate(FoundFeature& feature, const Frame& frame, const Frame& before) noexcept {
  const double deviation_px = kUnmappedMotion_px_per_s * stride_s_;
  const Matrix2d covariance = deviation_px * deviation_px * Matrix2d::Identity();
  const PatchState last = feature.patch_state;
  const Vector2d predicted_px = last.px + feature.velocity_px;
  const GreyImage image = image_of(frame), image_before = image_of(before);
  PatchMatch match = tracker_.track(image, feature.patch, feature.patch_state, predicted_px, covariance);
  const double usual_frames = FrameRate::kUsual_per_s * stride_s_;
  if (match.state == MatchState::kFound &&
      feature.looks.is_plausible(last, feature.patch_state, match.correlation, usual_frames)) {
    feature.looks.add(match.correlation);
    feature.place_px2 = larger_eigenvalue(match.covariance_px2);
    return match;
  }
  feature.patch_state = last;
  LastView view;
  view.make(image_before, 0, last.px, tracker_.kernels());
  if (!view.is_of(0)) return {};
  view.begin_at(feature.place_px2);
  match = view.follow(view_tracker_, image, image_before, last.px, predicted_px, covariance);
  if (match.state == MatchState::kFound) {
    feature.patch_state.px = match.px;
    feature.place_px2 = larger_eigenvalue(match.covariance_px2);
  }
  return match;
}

void FeatureFinder::track_candidates(const Frame& frame, const Frame& before) noexcept {
  std::erase_if(found_, [&](FoundFeature& feature) {
    const Vector2d last_px = feature.patch_state.px;
    const PatchMatch match = find_candidate(feature, frame, before);
    feature.velocity_px = feature.patch_state.px - last_px;
    feature.doubt_px += std::sqrt(larger_eigenvalue(match.covariance_px2));
    return match.state != MatchState::kFound;
  });
}

// As many as are wanted come first, for the others there may be room yet; both in the order in which they were found,
// which spreads them over the picture.
void FeatureFinder::put_the_surest_first() noexcept {
  if (found_.size() > wanted_) {
    std::vector<double> doubts;
    for (const FoundFeature& feature : found_) doubts.push_back(feature.doubt_px);
    const auto last = doubts.begin() + static_cast<std::ptrdiff_t>(wanted_) - 1;
    std::nth_element(doubts.begin(), last, doubts.end());
    std::stable_partition(found_.begin(), found_.end(),
                          [most = *last](const FoundFeature& feature) { return feature.doubt_px <= most; });
  }
  if (found_.size() > share_) found_.resize(share_);
}

}  // namespace perimap
