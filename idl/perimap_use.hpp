// For subscribers: what a surface, and each of its positions, may be used for.
//
//   if (perimap::client::state_for(*surface, perimap::client::Use::kContact) == perimap_SURFACE_GOOD) {
//     for (each feature) if (usable_for(*surface, feature, perimap::client::Use::kContact)) touch(feature);
//   }
//
// Needs C++17, the C types that idlc makes of perimap.idl, and nothing else. Lengths are millimetres. Whether a sample
// is in time, and whether one publisher is heard, is asked before (perimap_publisher_watch.hpp).
#pragma once

#include <perimap.h>

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace perimap::client {

// To show it, to measure in it, to act in contact with it.
enum class Use : std::uint8_t { kDisplay, kMeasure, kContact };

// 95 % of errors or more are within so much, in whatever direction they are most likely, where the covariance is right:
// twice the root mean square error. `covariance_mm2`: xx xy xz yy yz zz.
inline double within_mm(const double* covariance_mm2) noexcept {
  return 2.0 * std::sqrt(covariance_mm2[0] + covariance_mm2[3] + covariance_mm2[5]);
}

// What perimapd's configuration asks of the use; 0: an older perimapd, which tells nothing of uses.
inline double bound_mm(const perimap_Surface& surface, Use use) noexcept {
  return surface.use_within_mm[static_cast<std::size_t>(use)];
}

// Of the surface as a whole. SURFACE_INVALID where nothing is told of uses.
inline perimap_SurfaceState state_for(const perimap_Surface& surface, Use use) noexcept {
  if (!(bound_mm(surface, use) > 0.0)) return perimap_SURFACE_INVALID;
  switch (use) {
    case Use::kDisplay:
      return surface.display_state;
    case Use::kMeasure:
      return surface.measure_state;
    case Use::kContact:
      return surface.contact_state;
  }
  return perimap_SURFACE_INVALID;
}

// Of one of its positions: the surface is good for the use, the feature has converged, and is within the bound.
inline bool usable_for(const perimap_Surface& surface, const perimap_SurfaceFeature& feature, Use use) noexcept {
  return state_for(surface, use) == perimap_SURFACE_GOOD && feature.state == perimap_FEATURE_CONVERGED &&
         within_mm(feature.covariance_W_mm2) <= bound_mm(surface, use);
}

}  // namespace perimap::client
