#include "core/following/birth_layout.hpp"

#include <cstddef>

namespace perimap {

std::optional<double> off_among_its_own(std::span<const FollowedFeature> features, const FollowedFeature& feature,
                                        double alike_px, CommonMotion& scratch) noexcept {
  constexpr std::size_t kEnoughToTell = 12;
  scratch.clear();
  std::size_t others = 0;
  for (const FollowedFeature& other : features) {
    if (!other.found || other.is_away || other.first_frame != feature.first_frame) continue;
    scratch.add(other.first_px, other.px);
    ++others;
  }
  if (others < kEnoughToTell || 2 * scratch.agree(alike_px) < others) return std::nullopt;
  if (!scratch.holds_around(feature.first_px)) return std::nullopt;
  return (feature.px - scratch.at(feature.first_px)).norm();
}

}  // namespace perimap
