// One published surface beside the truth.
#pragma once

#include <perimap.h>

#include <cstdint>
#include <vector>

namespace perimap {

struct JudgedSurface {
  double released_s = 0.0;  // from the first frame
  perimap_SurfaceState state = perimap_SURFACE_INVALID;
  perimap_SurfaceReason reason = perimap_SURFACE_REASON_NONE;
  std::uint32_t once_converged = 0;      // features in it that have been called converged by then, and are not invalid
  std::uint32_t good = 0;                // of those, converged in a surface that is good
  std::uint32_t once_converged_off = 0;  // of the first, off by more than 3 mm
  std::vector<std::uint32_t> good_ids_off;  // of the second, likewise
  double largest_good_mm = 0.0;             // error of the second; 0 without any
  bool before_known = false;                // released before a premature beat could be known
};

}  // namespace perimap
