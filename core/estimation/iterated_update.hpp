// The recursive update of one feature by one observation, iterated in three dimensions.
//
// Tully, Kantor & Choset (2013) minimise by damped Gauss-Newton
//
//   J(x) = (x - x^)^T P^-1 (x - x^) + (z - h(x))^T R^-1 (z - h(x)).
//
// The phase is fixed during an update, so h sees x only through p = B x, and every minimiser has the form x^ + M lambda
// with M = P B^T (d x 3). With S = B M (3x3), p = B x^ + S lambda:
//
//   J(lambda) = lambda^T S lambda + r^T R^-1 r,   r = z - h(p).
//
// So the iterations cost the same for any number of harmonics, and neither P nor S is ever inverted. At the end x = x^
// + M lambda and P <- P - U U^T with U (d x 2) from H re-evaluated at the final x.
#pragma once

#include <cstdint>

#include "core/estimation/feature_estimate.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/estimation/observation.hpp"
#include "core/estimation/update_settings.hpp"

namespace perimap {

enum class UpdateStatus : std::uint8_t {
  kAccepted,
  kRejectedByGate,
  kBehindCamera,
  kFoldedBack,
  kNotFinite,     // NaN or infinity in, or out
  kNotPositive,   // R not positive definite, or P would lose a positive diagonal
  kSizeMismatch,  // basis, state and covariance do not fit together
};

// Why an update is refused whose measurement can not be predicted; kAccepted for kOk.
[[nodiscard]] UpdateStatus status_of(ProjectionStatus status) noexcept;

struct UpdateOutcome {
  bool accepted = false;
  UpdateStatus status = UpdateStatus::kNotFinite;
  // J at the end. In the linear case it equals the NIS.
  double map_cost = 0.0;
  // z - h(x^) at the prediction, and its square normalised by R + H P H^T there (2 degrees of freedom).
  Vector2d innovation = Vector2d::Zero();
  double normalised_innovation_squared = 0.0;
  int iterations = 0;
};

// Whatever the status other than kAccepted, the estimate stays as it was. P stays symmetric bit by bit.
template <class Model>
UpdateOutcome iterated_update(FeatureEstimate& estimate, const Observation& observation, const Model& model,
                              const UpdateSettings& settings = {}) noexcept;

extern template UpdateOutcome iterated_update(FeatureEstimate&, const Observation&, const PixelModel&,
                                              const UpdateSettings&) noexcept;
extern template UpdateOutcome iterated_update(FeatureEstimate&, const Observation&, const BearingModel&,
                                              const UpdateSettings&) noexcept;

}  // namespace perimap
