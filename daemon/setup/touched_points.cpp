#include "daemon/setup/touched_points.hpp"

#include "core/calibration/touched_landmarks.hpp"

namespace perimap {

TouchedPoints touched_points(const std::vector<TimedPose>& poses, const Vector3d& tip_T,
                             const std::vector<NamedPoint>& model, const TouchRule& rule) {
  std::vector<TimedPoint> tip_W;
  for (const TimedPose& pose : poses) tip_W.push_back({pose.t_s, pose.X * tip_T});
  TouchedPoints result;
  result.touches = find_dwells(tip_W, rule.shortest_s, rule.radius_mm);
  std::vector<Vector3d> landmarks_I;
  for (const NamedPoint& point : model) landmarks_I.push_back(point.p);
  std::vector<Vector3d> places_W;
  for (const Dwell& touch : result.touches) places_W.push_back(touch.p);
  const auto chosen = touched_landmarks(landmarks_I, places_W);
  if (!chosen) return result;
  result.landmarks_W.emplace();
  for (std::size_t i = 0; i < model.size(); ++i) {
    result.landmarks_W->push_back({model[i].name, places_W[chosen->at(i)]});
  }
  return result;
}

}  // namespace perimap
