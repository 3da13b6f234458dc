#include "daemon/evaluation/track_judge/round_trip.hpp"

#include <algorithm>
#include <vector>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

std::size_t count_jumps(const Track& track, double most_px) {
  std::size_t jumps = 0;
  std::optional<Vector2d> before;
  for (const auto& px : track) {
    if (!px) continue;
    if (before && (*px - *before).norm() > most_px) ++jumps;
    before = px;
  }
  return jumps;
}

}  // namespace

std::optional<std::size_t> begin_of(const Track& track) {
  for (std::size_t k = 0; k < std::min(TripLimits::kFirstFrames, track.size()); ++k) {
    if (track[k]) return k;
  }
  return std::nullopt;
}

TripFigures judge_round_trip(const Tracks& tracks, std::size_t turn, int width,
                             const std::map<std::uint32_t, Vector2d>& reference, const TripLimits& limits) {
  constexpr double kWidth = 1280;
  const double scale = width / kWidth;
  const std::size_t last = 2 * turn;
  TripFigures figures;
  std::vector<double> errors_px;
  for (const auto& [id, track] : tracks) {
    figures.jumps += count_jumps(track, limits.jump_px);
    const auto begin = begin_of(track);
    if (!begin) continue;
    ++figures.begun;
    TripVerdict& verdict = figures.verdicts[id] = TripVerdict::kLost;
    if (!track[last] || !track[last - *begin]) continue;
    ++figures.alive;
    const double error_px = (*track[last - *begin] - *track[*begin]).norm();
    errors_px.push_back(error_px);
    if (error_px > limits.off_px * scale) ++figures.off;
    const auto other = reference.find(id);
    const bool is_astray =
        other != reference.end() && (!track[turn] || (*track[turn] - other->second).norm() > limits.turn_px * scale);
    if (error_px > limits.back_px * scale) {
      verdict = TripVerdict::kElsewhere;
    } else if (is_astray) {
      verdict = TripVerdict::kStrayed;
    } else {
      verdict = TripVerdict::kRight;
      ++figures.right;
    }
  }
  if (!errors_px.empty()) figures.median_px = upper_median(errors_px.begin(), errors_px.end());
  return figures;
}

}  // namespace perimap
