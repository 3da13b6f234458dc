// What a feature tells the surface: its motion, and how surely its mean place and each harmonic are known.
#pragma once

#include <array>
#include <cstdint>

#include "core/estimation/feature_estimate.hpp"
#include "core/geometry/pose.hpp"
#include "core/periodic/periodic_motion.hpp"

namespace perimap {

inline constexpr std::size_t kMaxBands = kMaxHarmonics + kMaxRespiratoryHarmonics;

// Over a whole cycle the covariances of the mean with a harmonic and of one harmonic with another cancel, and a cosine
// counts as much as its sine. So the position's covariance, averaged over the cycle, is the sum of these 3x3 blocks.
struct SurfaceEvidence {
  std::uint32_t id = 0;
  StateVector x;                                // mm, frame W, order of periodic_motion.hpp
  Matrix3d mean_mm2 = Matrix3d::Zero();         // of the mean place
  std::array<Matrix3d, kMaxBands> bands_mm2{};  // half the sum of cosine's and sine's; cardiac, then respiratory
};

// The estimate's x must be of this layout.
[[nodiscard]] SurfaceEvidence surface_evidence(std::uint32_t id, const BasisLayout& layout,
                                               const FeatureEstimate& estimate) noexcept;

// x and every block of the layout are numbers, and no variance is negative.
[[nodiscard]] bool is_usable(const SurfaceEvidence& evidence, const BasisLayout& layout) noexcept;

// Where the cosine and the sine of band k (from 0; cardiac harmonics, then respiratory) stand in a basis.
struct BandPlace {
  int cosine = 0;
  int sine = 0;
};
[[nodiscard]] constexpr int bands(const BasisLayout& layout) noexcept {
  return layout.cardiac_harmonics + layout.respiratory_harmonics;
}
[[nodiscard]] constexpr BandPlace band_place(const BasisLayout& layout, int band) noexcept {
  const int H = layout.cardiac_harmonics;
  if (band < H) return {1 + band, 1 + H + band};
  const int first = 1 + 2 * H + band - H;
  return {first, first + layout.respiratory_harmonics};
}

}  // namespace perimap
