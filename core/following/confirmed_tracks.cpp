#include "core/following/confirmed_tracks.hpp"

#include <algorithm>
#include <iterator>

namespace perimap {

std::span<const TrackRow> ConfirmedTracks::add(std::uint64_t frame, std::span<const FollowedFeature> features) {
  released_.clear();
  std::vector<TrackRow>& rows = waiting_.emplace_back();
  for (const FollowedFeature& feature : features) {
    if (feature.is_overlay && feature.id < is_confirmed_.size()) is_confirmed_[feature.id] = false;
    if (!feature.found) continue;
    const bool is_candidate = feature.state == FollowState::kCandidate;
    rows.push_back({frame, feature.id, feature.px, is_candidate});
    if (is_confirmed_.size() <= feature.id) is_confirmed_.resize(feature.id + 1U);
    if (!is_candidate) is_confirmed_[feature.id] = true;
  }
  if (waiting_.size() > delay_frames_) release_oldest();
  return released_;
}

std::span<const TrackRow> ConfirmedTracks::finish() {
  released_.clear();
  if (!has_released_ && !waiting_.empty()) {
    for (const TrackRow& row : waiting_.back()) is_confirmed_[row.id] = true;
  }
  while (!waiting_.empty()) release_oldest();
  return released_;
}

void ConfirmedTracks::release_oldest() {
  has_released_ = true;
  const auto is_confirmed = [this](const TrackRow& row) { return is_confirmed_[row.id]; };
  std::copy_if(waiting_.front().begin(), waiting_.front().end(), std::back_inserter(released_), is_confirmed);
  waiting_.pop_front();
}

}  // namespace perimap
