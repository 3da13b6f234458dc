// What a surface may be used for: some uses bear a larger error than others.
#pragma once

#include <span>

#include "core/pipeline/surface_sample.hpp"

namespace perimap {

// 95 % of errors or more are within so much of the position, in whatever direction they are most likely, where the
// covariance is right: twice the root mean square error.
[[nodiscard]] double within_mm(const Matrix3d& covariance_mm2) noexcept;

// Of each use, whether a surface with this state and these features may be used so; `accounted_for`: see
// is_accounted_for(). What is invalid is that for every use. Else a use is good where at least half of the converged
// features, and one at least, are within its bound by their own covariance, and nothing is wrong; to show a surface,
// nothing but what the covariances account for: that what it rests on is older than it should be.
[[nodiscard]] UseVerdicts verdicts_by_use(SurfaceState state, bool accounted_for,
                                          std::span<const SurfaceFeature> features, const UseBounds& within) noexcept;

}  // namespace perimap
