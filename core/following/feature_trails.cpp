#include "core/following/feature_trails.hpp"

#include <algorithm>
#include <chrono>

namespace perimap {
namespace {

constexpr Duration kEvery = std::chrono::microseconds(33333);

}  // namespace

FeatureTrails::FeatureTrails(FrameRate rate) noexcept : stride_(rate.frames(kEvery)) {}

void FeatureTrails::begin(FollowedFeature& feature) const noexcept {
  feature.trail[place() % FollowedFeature::kTrail] = feature.px;
  feature.trail_length = 1;
}

void FeatureTrails::note(std::span<FollowedFeature> features) const noexcept {
  for (FollowedFeature& feature : features) {
    feature.trail[place() % FollowedFeature::kTrail] = feature.px;
    feature.trail_length = std::min(feature.trail_length + 1, FollowedFeature::kTrail);
  }
}

const Vector2d& FeatureTrails::at(const FollowedFeature& feature, std::size_t places_ago) const noexcept {
  return feature.trail[(place() - places_ago) % FollowedFeature::kTrail];
}

// Before this frame's own place is noted, from `places` places before it on.
bool FeatureTrails::has_stood_still(const FollowedFeature& feature, std::size_t places) const noexcept {
  constexpr double kStill_px = 0.4;
  if (feature.trail_length < places) return false;
  for (std::size_t ago = 1; ago <= places; ++ago) {
    if ((feature.px - at(feature, ago)).squaredNorm() > kStill_px * kStill_px) return false;
  }
  return true;
}

}  // namespace perimap
