// How far an estimated motion is from the true one, and what the data allow at best. "Over a cycle" is over the cardiac
// cycle and, where truth or estimate have a respiratory series, over every respiratory phase with every cardiac one.
#pragma once

#include <cstdint>
#include <vector>

#include "core/estimation/feature_estimate.hpp"
#include "daemon/evaluation/experiment/scene.hpp"

namespace perimap {

// RMS over a cycle of |p^ - p|, mm. The estimate may have another number of harmonics than the truth.
[[nodiscard]] double path_error_mm(const FeatureEstimate& estimate, const BasisLayout& layout, const Scene& scene,
                                   const SceneFeature& feature);

// Normalised squared error of the position divided by 3, mean over a cycle: 1 when the covariance is true.
[[nodiscard]] double normalised_squared_error(const FeatureEstimate& estimate, const BasisLayout& layout,
                                              const Scene& scene, const SceneFeature& feature);

// RMS over a cycle of the error that the covariance promises, mm.
[[nodiscard]] double path_deviation_mm(const FeatureEstimate& estimate, const BasisLayout& layout);

// The path errors (mm) of `draws` estimates whose errors are normal with the covariance: what is compared with the
// errors reached, quantile by quantile, where path_deviation_mm compares with their RMS. The same for the same seed.
[[nodiscard]] std::vector<double> drawn_path_errors_mm(const FeatureEstimate& estimate, const BasisLayout& layout,
                                                       int draws, std::uint64_t seed);

// Posterior Cramer-Rao bound of one feature from its sightings in frames before `end_frame`, outliers left out, pose
// noise white and of this feature alone: the truth with the bound as its covariance (Tichavsky, Muravchik & Nehorai,
// IEEE Trans. Signal Processing 46, 1998, for a state that stands still). Throws std::invalid_argument when `layout`
// lacks harmonics of the truth: no such estimator is free of bias.
[[nodiscard]] FeatureEstimate cramer_rao_bound(const Scene& scene, const SceneFeature& feature,
                                               const BasisLayout& layout, const Prior& prior, int end_frame);

// The q-quantile (0..1) by linear interpolation; NaN of nothing. Infinite values sort last.
[[nodiscard]] double quantile(std::vector<double> values, double q);

}  // namespace perimap
