// How far a match can be trusted.
#pragma once

#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/pose_noise.hpp"

namespace perimap {

// Covariance (px^2) of a match of p_WF: of the match itself, of what no match is better than, and of the pose.
// J_p = d px / d p_WF (2x3, px/mm).
[[nodiscard]] inline Matrix2d match_covariance(const HeldMatch& held, const FrameRecord& frame, const Vector3d& p_WF_mm,
                                               const Matrix23d& J_p, double pixel_deviation_px) noexcept {
  return held.covariance_px2 + pixel_deviation_px * pixel_deviation_px * Matrix2d::Identity() +
         pose_noise_covariance(frame.pose, p_WF_mm, J_p);
}

}  // namespace perimap
