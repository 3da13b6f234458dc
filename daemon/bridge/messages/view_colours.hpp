// Colours of what is drawn for viewers: apart by brightness too, for every eye.
#pragma once

#include <foxglove_view.h>
#include <perimap.h>

namespace perimap {

// Of a mesh: green or yellow, the less opaque the less certain.
[[nodiscard]] foxglove_Color colour_of(perimap_SurfaceState state, double deviation_mm) noexcept;
// Of a feature: converged green, converging yellow, inconsistent red.
[[nodiscard]] foxglove_Color colour_of(perimap_FeatureState state) noexcept;

// Of a tracked tool's tip: pink; white where it touches.
[[nodiscard]] foxglove_Color colour_of_tool(bool touches) noexcept;

}  // namespace perimap
