#include "core/surface/surface_evidence.hpp"

namespace perimap {

SurfaceEvidence surface_evidence(std::uint32_t id, const BasisLayout& layout,
                                 const FeatureEstimate& estimate) noexcept {
  const int n = layout.size();
  const auto block = [&](int element) {
    Matrix3d covariance;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        covariance(row, column) = estimate.P(row * n + element, column * n + element);
      }
    }
    return covariance;
  };
  SurfaceEvidence evidence;
  evidence.id = id;
  evidence.x = estimate.x;
  evidence.mean_mm2 = block(0);
  evidence.bands_mm2.fill(Matrix3d::Zero());
  for (int band = 0; band < bands(layout); ++band) {
    const BandPlace place = band_place(layout, band);
    evidence.bands_mm2[static_cast<std::size_t>(band)] = 0.5 * (block(place.cosine) + block(place.sine));
  }
  return evidence;
}

bool is_usable(const SurfaceEvidence& evidence, const BasisLayout& layout) noexcept {
  if (evidence.x.size() != layout.state_size() || !evidence.x.allFinite()) return false;
  const auto is_covariance = [](const Matrix3d& m) { return m.allFinite() && m.diagonal().minCoeff() >= 0.0; };
  if (!is_covariance(evidence.mean_mm2)) return false;
  for (int band = 0; band < bands(layout); ++band) {
    if (!is_covariance(evidence.bands_mm2[static_cast<std::size_t>(band)])) return false;
  }
  return true;
}

}  // namespace perimap
