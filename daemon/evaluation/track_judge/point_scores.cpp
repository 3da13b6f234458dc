#include "daemon/evaluation/track_judge/point_scores.hpp"

#include <cstddef>
#include <numeric>

namespace perimap {

PointScores score_points(const Tracks& tracks, const Tracks& truth) {
  constexpr std::size_t kThresholds = PointScores::kWithin_px.size();
  std::array<double, kThresholds> right{}, wrong{}, missed{};
  double visible = 0, all = 0, agreeing = 0;
  for (const auto& [id, points] : truth) {
    const auto found = tracks.find(id);
    bool is_given = false;
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto& point = points[k];
      if (!is_given) {
        is_given = point.has_value();
        continue;
      }
      const bool is_tracked = found != tracks.end() && k < found->second.size() && found->second[k];
      all += 1;
      visible += point ? 1 : 0;
      agreeing += is_tracked == point.has_value() ? 1 : 0;
      for (std::size_t t = 0; t < kThresholds; ++t) {
        const bool is_right = point && is_tracked && (*found->second[k] - *point).norm() < PointScores::kWithin_px[t];
        right[t] += is_right ? 1 : 0;
        wrong[t] += is_tracked && !is_right ? 1 : 0;
        missed[t] += point && !is_right ? 1 : 0;
      }
    }
  }
  PointScores scores;
  if (all > 0) scores.occlusion_accuracy = agreeing / all;
  for (std::size_t t = 0; t < kThresholds; ++t) {
    if (visible > 0) scores.delta[t] = right[t] / visible;
    const double either = right[t] + wrong[t] + missed[t];
    if (either > 0) scores.average_jaccard += right[t] / either / kThresholds;
  }
  scores.delta_average = std::accumulate(scores.delta.begin(), scores.delta.end(), 0.0) / kThresholds;
  return scores;
}

}  // namespace perimap
