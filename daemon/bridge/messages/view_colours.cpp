#include "daemon/bridge/messages/view_colours.hpp"

#include <algorithm>

namespace perimap {
namespace {

constexpr foxglove_Color kGreen{0.20, 0.80, 0.45, 1.0};
constexpr foxglove_Color kYellow{1.00, 0.85, 0.20, 1.0};
constexpr foxglove_Color kRed{0.90, 0.15, 0.30, 1.0};

constexpr foxglove_Color kPink{1.00, 0.45, 0.80, 1.0};
constexpr foxglove_Color kTouched{1.00, 1.00, 1.00, 1.0};

constexpr double kMostOpaque = 0.9;
constexpr double kLeastOpaque = 0.2;
constexpr double kLess_per_mm = 0.35;

}  // namespace

foxglove_Color colour_of(perimap_SurfaceState state, double deviation_mm) noexcept {
  foxglove_Color colour = state == perimap_SURFACE_GOOD ? kGreen : kYellow;
  colour.a = std::clamp(kMostOpaque - kLess_per_mm * deviation_mm, kLeastOpaque, kMostOpaque);
  return colour;
}

foxglove_Color colour_of(perimap_FeatureState state) noexcept {
  switch (state) {
    case perimap_FEATURE_CONVERGED:
      return kGreen;
    case perimap_FEATURE_CONVERGING:
      return kYellow;
    default:
      return kRed;
  }
}

foxglove_Color colour_of_tool(bool touches) noexcept { return touches ? kTouched : kPink; }

}  // namespace perimap
