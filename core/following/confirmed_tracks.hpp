// Tracks without what never became one: a candidate's rows wait until it is tracked, all for what may yet turn out to
// be laid over the picture.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "core/following/feature_follower.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

struct TrackRow {
  std::uint64_t frame = 0;
  std::uint32_t id = 0;
  Vector2d px = Vector2d::Zero();
  bool is_candidate = false;
};

// Gives the rows of a frame when delay_frames more have come: those of features that were tracked in one of the frames
// up to then, the rows of their time as candidates included, and not found to be overlays.
class ConfirmedTracks {
 public:
  explicit ConfirmedTracks(std::size_t delay_frames) : delay_frames_(delay_frames) {}

  // What was found in the next frame. Returns the rows that this releases, in the order of their frames; valid until
  // the next call.
  [[nodiscard]] std::span<const TrackRow> add(std::uint64_t frame, std::span<const FollowedFeature> features);
  // There are no more frames: what still waits. Where no row has been given yet, candidates of the last frame count as
  // tracked: there were too few frames to tell.
  [[nodiscard]] std::span<const TrackRow> finish();

 private:
  void release_oldest();

  std::size_t delay_frames_;
  bool has_released_ = false;
  std::deque<std::vector<TrackRow>> waiting_;  // a frame each
  std::vector<bool> is_confirmed_;             // by id
  std::vector<TrackRow> released_;
};

}  // namespace perimap
