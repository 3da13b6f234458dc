// Of FeatureFollower: what was away comes back alone, or is taken back.
#include <algorithm>
#include <cmath>

#include "core/following/birth_layout.hpp"
#include "core/following/feature_follower.hpp"

namespace perimap {
namespace {

constexpr Duration kUncovered = std::chrono::milliseconds(300);  // so long before it was lost nothing covered it yet

bool may_come_back(const FollowedFeature& feature) noexcept {
  return feature.state == FollowState::kOccluded && !feature.found && !feature.swept && feature.is_away;
}

}  // namespace

// The number of the layout that had it last before it was lost, so many frames ago.
std::uint32_t FeatureFollower::layout_before(const FollowedFeature& feature, int frames_ago) const noexcept {
  const auto ago = static_cast<std::uint64_t>(frames(kUncovered, 3) + frames_ago);
  if (trails_.frame() < ago) return 0;
  return layouts_.newest_with(feature, static_cast<std::size_t>(&feature - features_.data()), trails_.frame() - ago);
}

// By what motion the features of a layout have come to where they are found now. False where too few say so.
bool FeatureFollower::learn_motion_since(std::uint32_t layout, int width) noexcept {
  constexpr double kAlike_px = 3, kAlikeOfWidth = 0.015;
  constexpr std::size_t kEnough = 8, kShareFound = 4, kShareAlike = 3;  // one in so many at least
  return_.clear();
  std::size_t pairs = 0, all = 0;
  for (std::size_t slot = 0; slot < features_.size(); ++slot) {
    const FollowedFeature& feature = features_[slot];
    if (feature.state != FollowState::kTracked && feature.state != FollowState::kOccluded) continue;
    const auto then = layouts_.place_in(layout, feature, slot);
    if (!then) continue;
    ++all;
    if (!feature.found || feature.was_alone) continue;
    return_.add(*then, feature.px);
    ++pairs;
  }
  return pairs >= kEnough && kShareFound * pairs >= all &&
         kShareAlike * return_.agree(kAlike_px + kAlikeOfWidth * width) >= pairs;
}

// What has been away for more than a moment is sought where those have it that were there with it.
void FeatureFollower::find_by_layouts(const GreyImage& image) noexcept {
  for (const std::uint32_t layout : layouts_.numbers()) {
    const auto is_of_layout = [layout](const FollowedFeature& feature) {
      return may_come_back(feature) && feature.layout == layout;
    };
    if (layout == 0 || std::none_of(features_.begin(), features_.end(), is_of_layout)) continue;
    if (!learn_motion_since(layout, image.width)) continue;
    seek_by_layout(image, layout);
    believe_by_layout(image, layout);
  }
}

// Near where it ought to be, and then widely: what is covered has gone its own way with all that is covered.
void FeatureFollower::seek_by_layout(const GreyImage& image, std::uint32_t layout) noexcept {
  constexpr double kDeviation_px = 1.5, kDeviationOfWidth = 0.005, kWidely = 3;
  constexpr std::uint64_t kOneIn = 3;  // what has been away for long is not sought in every frame
  const double deviation_px = kDeviation_px + kDeviationOfWidth * image.width;
  const int occluded = frames(settings_.occluded, settings_.occluded_frames);
  for (std::size_t slot = 0; slot < features_.size(); ++slot) {
    FollowedFeature& feature = features_[slot];
    if (!may_come_back(feature) || feature.layout != layout) continue;
    const auto then = layouts_.place_in(layout, feature, slot);
    if (!then) continue;
    const Vector2d expected = return_.at(*then);
    feature.has_layout = true;
    feature.last_px = expected - displacement_around(expected, nullptr);
    feature.px = expected;
    if (feature.misses > occluded && (trails_.frame() + slot) % kOneIn != 0) continue;
    if (!seek(image, feature, expected, deviation_px, settings_.vouched_correlation, true, return_.shape())) {
      (void)seek(image, feature, expected, std::min(kWidely * deviation_px, settings_.widest_deviation_px),
                 settings_.vouched_correlation, true, return_.shape());
    }
  }
  for (std::size_t slot = 0; slot < features_.size(); ++slot) {
    const FollowedFeature& feature = features_[slot];
    if (!feature.has_layout || feature.layout != layout || !feature.found) continue;
    return_.add(*layouts_.place_in(layout, feature, slot), feature.px);
  }
}

// What was found counts where those around it that were there with it have come the same way. Where they have come,
// what was not found is sought once more.
void FeatureFollower::believe_by_layout(const GreyImage& image, std::uint32_t layout) noexcept {
  constexpr double kAlike_px = 2, kAlikeOfWidth = 0.006, kOff_px = 1.5, kOffOfWidth = 0.004;
  const double alike_px = kAlike_px + kAlikeOfWidth * image.width;
  const double off_px = std::max(kOff_px, kOffOfWidth * image.width);
  for (std::size_t slot = 0; slot < features_.size(); ++slot) {
    FollowedFeature& feature = features_[slot];
    if (!feature.has_layout || feature.layout != layout) continue;
    const Vector2d then = *layouts_.place_in(layout, feature, slot);
    const auto told = return_.beside(then, alike_px, &then);
    const auto is_there = [&] { return feature.found && told && (feature.px - *told).norm() <= off_px; };
    if (told && !is_there()) {
      if (feature.found) disbelieve(feature);
      (void)seek(image, feature, *told, off_px, settings_.recalled_correlation, true, return_.shape());
    }
    feature.is_recalled = is_there();
    if (feature.is_recalled) continue;
    if (feature.found) disbelieve(feature);
    if (told) feature.px = *told;
  }
}

// Near where it is expected, since others vouch for that.
bool FeatureFollower::seek_vouched_for(const GreyImage& image, FollowedFeature& feature, const Vector2d& expected,
                                       double deviation_px, const Matrix2d& reshaped_by) const noexcept {
  constexpr double kOff_px = 2, kOffOfWidth = 0.006;
  const FollowedPatch::Places places = feature.patch.places();
  if (!seek(image, feature, expected, deviation_px, settings_.vouched_correlation, true, reshaped_by)) return false;
  const bool is_sure = feature.match.correlation >= settings_.recovered_correlation;
  if (is_sure || (feature.px - expected).norm() <= kOff_px + kOffOfWidth * image.width) return true;
  feature.patch.put_back(places);
  feature.found = false;
  feature.px = feature.last_px;
  return false;
}

// What its own velocity did not find, and what was occluded: with the displacement of what is around it.
void FeatureFollower::find_again(const GreyImage& image) noexcept {
  find_by_layouts(image);
  for (FollowedFeature& feature : features_) {
    if (feature.state == FollowState::kEmpty || feature.found || feature.swept || feature.has_layout) continue;
    const NeighbourMotion::Around neighbours = around(feature.last_px, &feature);
    constexpr double kShareKept = 0.5;  // of a velocity that nothing confirms
    const Vector2d expected = feature.last_px + (neighbours.known ? 1.0 : kShareKept) * neighbours.by;
    const bool is_occluded = feature.state == FollowState::kOccluded;
    // Unseen for long, the place has been carried along without a measurement.
    constexpr double kDrift_px_per_s = 3.0;
    const double deviation_px = std::min(2 * deviation_px_ + kDrift_px_per_s / settings_.rate.per_s() * feature.misses,
                                         settings_.widest_deviation_px);
    // What its region hid comes back with what is around it.
    const bool is_vouched_for = is_occluded && feature.hidden > 0 && neighbours.known;
    const bool is_found = is_vouched_for ? seek_vouched_for(image, feature, expected, deviation_px)
                                         : seek(image, feature, expected, deviation_px,
                                                is_occluded ? settings_.recovered_correlation : 0);
    if (!is_found) feature.px = expected;
  }
}

// What was away and has come back alone: many places look like one that has not been seen for long.
void FeatureFollower::hold_against_others(const GreyImage& image) noexcept {
  constexpr double kAlikeOfWidth = 0.03, kOff_px = 3, kOffOfWidth = 0.015;
  for (FollowedFeature& feature : features_) {
    if (!feature.found || !feature.is_away || feature.is_recalled) continue;
    const auto off_px = off_among_its_own(features_, feature, kAlikeOfWidth * image.width, return_);
    if (off_px && *off_px > kOff_px + kOffOfWidth * image.width) disbelieve(feature);
  }
}

// What went another way than its neighbours follows something else: what came over it, a highlight. It is sought again
// where they have it, by its views of before. False where it has none, or has gone astray too often.
bool FeatureFollower::take_back_stray(FollowedFeature& feature, int missed_frames) noexcept {
  constexpr int kMostStrays = 2;
  if (feature.state != FollowState::kTracked || feature.strays >= kMostStrays) return false;
  const std::uint32_t layout = layout_before(feature, frames(kUncovered, 3));
  if (layout == 0) return false;
  ++feature.strays;
  feature.layout = layout;
  feature.state = FollowState::kOccluded;
  feature.found = false;
  feature.is_away = true;
  feature.misses = missed_frames + 1;
  feature.px -= feature.astray_px;
  feature.velocity_px.setZero();
  feature.astray_px.setZero();
  feature.strange = 0;
  feature.patch.forget_since(trails_.frame() - static_cast<std::uint64_t>(2 * frames(kUncovered, 3)));
  return true;
}

}  // namespace perimap
