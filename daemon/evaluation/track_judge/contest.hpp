// Both trackers over one clip, there and back.
#pragma once

#include "core/error/expected.hpp"
#include "daemon/evaluation/track_judge/clip.hpp"
#include "daemon/evaluation/track_judge/round_trip.hpp"
#include "daemon/evaluation/track_judge/tracks.hpp"

namespace perimap {

struct Contest {
  Tracks ours, theirs;
  TripFigures our_figures, their_figures;
};

// This tracker with no new features after the first, and Lucas-Kanade (lucas_kanade.hpp) with its own
// corners, of as many features.
[[nodiscard]] Expected<Contest> hold_contest(const Clip& clip, int features);

}  // namespace perimap
