// The pipeline's surface as the wire type of idl/perimap.idl.
#pragma once

#include <perimap.h>

#include <vector>

#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "daemon/publishing/identity.hpp"

namespace perimap {

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

[[nodiscard]] perimap_SurfaceState to_wire(SurfaceState state) noexcept;
[[nodiscard]] perimap_SurfaceReason to_wire(SurfaceReason reason) noexcept;
[[nodiscard]] perimap_FeatureState to_wire(FeatureState state) noexcept;
[[nodiscard]] perimap_FeatureReason to_wire(FeatureReason reason) noexcept;

}  // namespace perimap
