// The pipeline's surface as the wire type of idl/perimap.idl.
#pragma once

#include <perimap.h>

#include <cstddef>
#include <vector>

#include "core/time/instant.hpp"
#include "daemon/publishing/identity.hpp"

namespace perimap {

struct PipelineSettings;
struct SurfaceSample;

class WireSurface {
 public:
  WireSurface(const Identity& identity, std::size_t maximum_features);
  // The message points to the features, which a move takes along and a copy would not.
  WireSurface(WireSurface&&) = default;
  WireSurface(const WireSurface&) = delete;
  WireSurface& operator=(WireSurface&&) = default;
  WireSurface& operator=(const WireSurface&) = delete;
  ~WireSurface() = default;

  // No allocation. `utc_minus_monotonic` gives the release its UTC. Valid until the next call.
  [[nodiscard]] const perimap_Surface& fill(const SurfaceSample& sample, Duration utc_minus_monotonic) noexcept;

 private:
  std::vector<perimap_SurfaceFeature> features_;
  perimap_Surface wire_{};
};

// One for each ReleaseStream, in their order.
[[nodiscard]] std::vector<WireSurface> wire_surfaces(const Identity& identity, const PipelineSettings& settings);

}  // namespace perimap
