#include "core/estimation/feature_prior.hpp"

namespace perimap {

FeaturePrior wide_prior(const BasisLayout& layout, const Prior& prior, const Vector3d& p_WF) noexcept {
  const int n = layout.size();
  const Basis deviations = prior_deviations(layout, prior);
  FeaturePrior wide;
  wide.x.setZero(3 * n);
  for (int axis = 0; axis < 3; ++axis) wide.x(axis * n) = p_WF(axis);
  for (int k = 0; k < n; ++k) {
    wide.factors_mm[static_cast<std::size_t>(k)] = deviations(k) * Matrix3d::Identity();
  }
  return wide;
}

}  // namespace perimap
