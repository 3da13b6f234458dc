#include "daemon/bridge/messages/view_worth.hpp"

#include <algorithm>

#include "daemon/bridge/messages/lent.hpp"
#include "daemon/publishing/wire_names.hpp"
#include "drivers/recording/foxglove_image.hpp"

namespace perimap {

const perimap_view_SurfaceWorth& ViewWorth::of(const ShownSurface& surface, Instant utc) {
  const auto converged = [](const ShownFeature& feature) { return feature.state == perimap_FEATURE_CONVERGED; };
  state_ = name_of(surface.state);
  reason_ = name_of(surface.reason);
  worth_.timestamp = to_foxglove_time(utc);
  worth_.state = lent(state_);
  worth_.reason = lent(reason_);
  worth_.features = static_cast<std::uint32_t>(surface.features.size());
  worth_.converged =
      static_cast<std::uint32_t>(std::count_if(surface.features.begin(), surface.features.end(), converged));
  worth_.phase_rad = surface.phase_rad;
  return worth_;
}

}  // namespace perimap
