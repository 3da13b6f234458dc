// The start of a feature on the surface that others have made, from few matches.
//
// Not for the real-time path: it allocates. Deterministic.
#pragma once

#include <cstdint>
#include <span>

#include "core/estimation/batch_start.hpp"
#include "core/surface/periodic_surface.hpp"

namespace perimap {

enum class SurfaceStartKind : std::uint8_t {
  kStarted,
  kNotThere,     // the surface has no support where the matches are
  kContradicts,  // they are not of the surface: an instrument, a reflection, something before it
  kUnusable      // the matches can not be used
};

struct SurfaceStart {
  SurfaceStartKind kind = SurfaceStartKind::kNotThere;
  BatchOutcome outcome;  // ok where it started
};

template <class Model>
[[nodiscard]] SurfaceStart start_on_surface(const PeriodicSurface& surface, std::span<const Observation> observations,
                                            const Model& model, const BatchSettings& settings = {});

extern template SurfaceStart start_on_surface(const PeriodicSurface&, std::span<const Observation>, const PixelModel&,
                                              const BatchSettings&);
extern template SurfaceStart start_on_surface(const PeriodicSurface&, std::span<const Observation>, const BearingModel&,
                                              const BatchSettings&);

}  // namespace perimap
