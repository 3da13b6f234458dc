// The start of a feature of which more is known beforehand than that it may be anywhere: as batch_start.hpp, from the
// prior's own mean alone.
//
// Not for the real-time path: it allocates. Deterministic.
#pragma once

#include <span>

#include "core/estimation/batch_start.hpp"
#include "core/estimation/feature_prior.hpp"

namespace perimap {

struct PriorStart {
  BatchOutcome outcome;
  // Where it is ok: the square of what lies between prior and estimate, in the prior's deviations, beside what is
  // expected; about 1.
  double prior_misfit = 0.0;
};

template <class Model>
[[nodiscard]] PriorStart start_from_prior(std::span<const Observation> observations, const Model& model,
                                          const FeaturePrior& prior, const BatchSettings& settings = {});

extern template PriorStart start_from_prior(std::span<const Observation>, const PixelModel&, const FeaturePrior&,
                                            const BatchSettings&);
extern template PriorStart start_from_prior(std::span<const Observation>, const BearingModel&, const FeaturePrior&,
                                            const BatchSettings&);

}  // namespace perimap
