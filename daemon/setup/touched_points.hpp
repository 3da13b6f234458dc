// The landmarks of a patient's image among the places where a pointer's tip was held still.
#pragma once

#include <optional>
#include <vector>

#include "core/calibration/dwells.hpp"
#include "core/calibration/timed_poses.hpp"
#include "drivers/pose_file/point_table.hpp"

namespace perimap {

// What counts as a touch.
struct TouchRule {
  double shortest_s = 1.5;
  double radius_mm = 4.0;
};

struct TouchedPoints {
  std::vector<Dwell> touches;  // all, in the order of their times
  // Of each landmark, in the order of the model; none: they are not told among those touches (touched_landmarks()).
  std::optional<std::vector<NamedPoint>> landmarks_W;
};

// `poses` of the tool, in the order of their times.
[[nodiscard]] TouchedPoints touched_points(const std::vector<TimedPose>& poses, const Vector3d& tip_T,
                                           const std::vector<NamedPoint>& model, const TouchRule& rule);

}  // namespace perimap
