// Poses over time as a calibration gets them: a whole sequence at once, with dropouts, in the order of their times.
#pragma once

#include <optional>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

struct TimedPose {
  double t_s = 0.0;
  Pose X;  // mm
};

// In the order of their times, each time once: of several at one time the first is kept.
[[nodiscard]] std::vector<TimedPose> in_order(std::vector<TimedPose> poses);

// Of consecutive times; 0 with fewer than two.
[[nodiscard]] double median_interval_s(const std::vector<TimedPose>& poses);
// Between poses of one motion: three median intervals, and 0.1 s at least.
[[nodiscard]] double longest_gap_s(const std::vector<TimedPose>& poses);

struct PoseWithTwist {
  Pose X;
  Vector6d twist = Vector6d::Zero();  // in the moving frame: angular velocity, rad/s, then velocity, mm/s
};

// In the frame of a tool that moves itself (X_TS of X_WS and X_WT), at the times of `poses`; those at which the tool
// was not seen are left out. Both as in_order() gives them.
[[nodiscard]] std::vector<TimedPose> in_frame_of(const std::vector<TimedPose>& tool,
                                                 const std::vector<TimedPose>& poses);

// Between the two poses around t (constant angular velocity, translation linear); none outside, or in a gap that is
// longer. `poses` as in_order() gives them.
[[nodiscard]] std::optional<PoseWithTwist> pose_at(const std::vector<TimedPose>& poses, double t_s,
                                                   double longest_gap_s);

}  // namespace perimap
