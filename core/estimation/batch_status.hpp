// How a batch start ended.
#pragma once

#include <cstddef>
#include <cstdint>

namespace perimap {

enum class BatchStatus : std::uint8_t {
  kOk,
  kTooFewObservations,
  kBadObservation,   // not finite, R not positive definite, a basis of another size, or the first has no ray
  kBehindCamera,     // from no start depth is the feature visible in any observation
  kDiverged,         // no start converged, or the solution is not finite
  kTooManyOutliers,  // fewer inliers than min_inlier_fraction or min_observations
};
inline constexpr std::size_t kBatchStatuses = 6;

}  // namespace perimap
