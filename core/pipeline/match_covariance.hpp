// How far a match can be trusted.
#pragma once

#include <algorithm>

#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/pose_noise.hpp"
#include "core/time/frame_rate.hpp"

namespace perimap {

// Errors of one feature's matches resemble each other from frame to frame: shading, foreshortening and the template's
// own noise change slowly. On rendered hearts at 30 frames/s their autocorrelation about their mean is 0.84 at one
// frame and 0.4 at eight, in sum about 16 frames or half a second, so that so many matches tell no more than one. The
// filter takes their errors as white: its covariance is right when each is given the covariance of them all.
inline constexpr double kMatchesAlike = 16;  // at the usual rate

// So many of the matches that come at this rate tell no more than one.
[[nodiscard]] inline double matches_alike(const FrameRate& rate) noexcept {
  return std::max(1.0, kMatchesAlike / rate.of_usual());
}

// Covariance (px^2) of a match for the filter: its own as one of `alike`, and of what no match is better than.
[[nodiscard]] inline Matrix2d match_covariance(const Matrix2d& of_patch_px2, double pixel_deviation_px,
                                               double alike = kMatchesAlike) noexcept {
  return alike * of_patch_px2 + pixel_deviation_px * pixel_deviation_px * Matrix2d::Identity();
}

// The same with what the pose adds to a match of p_WF. J_p = d px / d p_WF (2x3, px/mm).
[[nodiscard]] inline Matrix2d match_covariance(const HeldMatch& held, const FrameRecord& frame, const Vector3d& p_WF_mm,
                                               const Matrix23d& J_p, double pixel_deviation_px, double alike) noexcept {
  return match_covariance(held.covariance_px2, pixel_deviation_px, alike) +
         pose_noise_covariance(frame.pose, p_WF_mm, J_p);
}

}  // namespace perimap
