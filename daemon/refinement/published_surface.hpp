// The newest surface of a recording of what was published, as it is at a phase of the heart.
#pragma once

#include <cstddef>
#include <string>

#include "core/error/expected.hpp"
#include "core/registration/model_fit.hpp"

namespace perimap {

struct PublishedSurface {
  SurfacePoints points;
  std::size_t features = 0;         // that it rests on
  double feature_spacing_mm = 0.0;  // about how far they are apart
  double common_share = 0.0;        // of its errors' variance that all of it has, by what it says of itself
  double phase_rad = 0.0;           // of the heart
  double since_begin_s = 0.0;       // of the recording: when the surface was published
  bool breath_known = false;        // what breathing does has been taken out
};

// `cycle_share`: of the time from one R peak to the next, 0 to 1, in the newest cycle that the surface's phases tell
// of. Fails where there is no surface, with the reason that was published, or none that can be moved to that phase.
[[nodiscard]] Expected<PublishedSurface> read_published_surface(const std::string& recording, double cycle_share);

}  // namespace perimap
