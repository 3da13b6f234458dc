// Tracks against known points, in the form in which point trackers are publicly compared: TAP-Vid (Doersch et al.,
// "TAP-Vid: A benchmark for tracking any point in a video", NeurIPS 2022), with the thresholds of STIR (Schmidt et al.,
// "Surgical tattoos in infrared", IEEE TMI 2024).
#pragma once

#include <array>

#include "daemon/evaluation/track_judge/tracks.hpp"

namespace perimap {

struct PointScores {
  static constexpr std::array<double, 5> kWithin_px = {4, 8, 16, 32, 64};
  std::array<double, 5> delta{};  // the share of visible points that are tracked within each distance
  double delta_average = 0;
  // Mean over the distances of: right ones over right, wrong and missed ones together. A track that is there while its
  // point is hidden is wrong; one too far off is wrong and its point missed.
  double average_jaccard = 0;
  double occlusion_accuracy = 0;  // the share of points that are rightly there or not
};

// `truth` has a place where the point is visible and none where it is hidden; tracks are those of the same number. The
// first place of each point is where it was given, and does not count.
[[nodiscard]] PointScores score_points(const Tracks& tracks, const Tracks& truth);

}  // namespace perimap
