// What a surface is worth, in words and figures that viewers can plot.
#pragma once

#include <foxglove_view.h>

#include <string>

#include "core/time/instant.hpp"
#include "daemon/subscribing/shown_surface.hpp"

namespace perimap {

class ViewWorth {
 public:
  // Stamped with `utc`, that of the surface's valid_time. Borrowed until the next call.
  [[nodiscard]] const perimap_view_SurfaceWorth& of(const ShownSurface& surface, Instant utc);

 private:
  std::string state_, reason_;
  perimap_view_SurfaceWorth worth_{};
};

}  // namespace perimap
