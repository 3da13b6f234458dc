#include "core/following/feature_places.hpp"

#include <algorithm>

namespace perimap {

void drop_doubles(std::span<FollowedFeature> features) noexcept {
  constexpr double kApart_px = 3.0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (!features[i].found) continue;
    for (std::size_t k = i + 1; k < features.size(); ++k) {
      if (!features[k].found || (features[i].px - features[k].px).squaredNorm() > kApart_px * kApart_px) continue;
      (features[i].frames < features[k].frames ? features[i] : features[k]).let_go();
      if (!features[i].found) break;
    }
  }
}

std::ptrdiff_t filled_by_features(std::span<const FollowedFeature> features) noexcept {
  return std::count_if(features.begin(), features.end(), [](const FollowedFeature& feature) {
    return feature.state != FollowState::kCandidate && feature.fills_place();
  });
}

void promote_the_surest(std::span<FollowedFeature> features, int maximum) noexcept {
  std::ptrdiff_t room = maximum - filled_by_features(features);
  for (;; --room) {
    FollowedFeature* surest = nullptr;
    for (FollowedFeature& feature : features) {
      if (feature.state != FollowState::kCandidate || !feature.is_ripe) continue;
      if (surest == nullptr || feature.doubt_px < surest->doubt_px) surest = &feature;
    }
    if (surest == nullptr) return;
    if (room > 0) {
      surest->state = FollowState::kTracked;
    } else {
      surest->let_go();
    }
  }
}

void keep_to_maximum(std::span<FollowedFeature> features, int maximum) noexcept {
  for (std::ptrdiff_t filled = filled_by_features(features); filled > maximum; --filled) {
    FollowedFeature* youngest = nullptr;
    for (FollowedFeature& feature : features) {
      if (feature.state == FollowState::kCandidate || !feature.fills_place()) continue;
      if (youngest == nullptr || feature.frames < youngest->frames) youngest = &feature;
    }
    youngest->let_go();
  }
}

FollowedFeature* place_for_new(std::span<FollowedFeature> features) noexcept {
  FollowedFeature* longest_away = nullptr;
  for (FollowedFeature& feature : features) {
    if (feature.is_overlay || feature.fills_place()) continue;
    if (feature.state == FollowState::kEmpty) return &feature;
    if (longest_away == nullptr || feature.misses > longest_away->misses) longest_away = &feature;
  }
  return longest_away;
}

}  // namespace perimap
