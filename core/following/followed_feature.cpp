#include "core/following/followed_feature.hpp"

namespace perimap {

bool FollowedFeature::fills_place() const noexcept {
  return state == FollowState::kCandidate || state == FollowState::kTracked ||
         (state == FollowState::kOccluded && !swept && !is_away);
}

void FollowedFeature::let_go() noexcept {
  state = FollowState::kEmpty;
  found = swept = false;
}

}  // namespace perimap
