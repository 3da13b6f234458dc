// How far a match can be trusted.
#pragma once

#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/pose_noise.hpp"

namespace perimap {

// Covariance (px^2) of a match for itself: its own, and of what no match is better than.
[[nodiscard]] inline Matrix2d match_covariance(const Matrix2d& of_patch_px2, double pixel_deviation_px) noexcept {
  return of_patch_px2 + pixel_deviation_px * pixel_deviation_px * Matrix2d::Identity();
}

// The same with what the pose adds to a match of p_WF. J_p = d px / d p_WF (2x3, px/mm).
[[nodiscard]] inline Matrix2d match_covariance(const HeldMatch& held, const FrameRecord& frame, const Vector3d& p_WF_mm,
                                               const Matrix23d& J_p, double pixel_deviation_px) noexcept {
  return match_covariance(held.covariance_px2, pixel_deviation_px) + pose_noise_covariance(frame.pose, p_WF_mm, J_p);
}

}  // namespace perimap
