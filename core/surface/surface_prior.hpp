// What the surface supposes of a feature that lies on it.
#pragma once

#include <optional>

#include "core/estimation/feature_prior.hpp"
#include "core/surface/periodic_surface.hpp"

namespace perimap {

// Of a feature whose mean place is about s (mm, of the chart): the harmonics as a vertex there has them; the mean place
// as deep as the surface is, and along the surface as good as free, since the feature's own matches tell that. Nothing
// where the surface has no support.
[[nodiscard]] std::optional<FeaturePrior> prior_at(const PeriodicSurface& surface, const Vector2d& s);

}  // namespace perimap
