// What is supposed of a feature's motion before its own matches.
#pragma once

#include <array>

#include "core/estimation/feature_estimate.hpp"
#include "core/geometry/pose.hpp"
#include "core/periodic/basis.hpp"
#include "core/periodic/periodic_motion.hpp"

namespace perimap {

// A mean, and for each element of the basis a covariance over the axes of W. The elements are independent.
struct FeaturePrior {
  StateVector x;                                 // mm, order of periodic_motion.hpp
  std::array<Matrix3d, kMaxBasis> factors_mm{};  // by element: L, lower triangular, its diagonal positive; P = L L^T
};

// An unmoving feature at p_WF that may move as any may.
[[nodiscard]] FeaturePrior wide_prior(const BasisLayout& layout, const Prior& prior, const Vector3d& p_WF) noexcept;

}  // namespace perimap
