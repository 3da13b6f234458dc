// Whether a match of two frames that follow each other leads back to where it began.
#pragma once

#include <optional>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/vision/patch_template.hpp"
#include "core/vision/patch_tracker.hpp"

namespace perimap {

// What is seen at px, whatever its texture: whether the place is a good one was judged when the feature began. It is
// followed without a change of its shape: from one frame to the next tissue hardly changes it, and weak texture does
// not determine more. False where no view can be had.
[[nodiscard]] bool make_view(const GreyImage& image, const Vector2d& px, const PatchKernels& kernels,
                             PatchTemplate& view) noexcept;

struct WayThere {
  const GreyImage& before;
  Vector2d from_px;       // in the frame before
  Vector2d predicted_px;  // where it was expected to lead
  double deviation_px;    // of the prediction, per axis
};

// A match may count when its way back ends so near where it began.
inline constexpr double kMostOffOnWayBack_px = 1.0;

// How far from where it began the way back ends, px: what is seen at found_px is sought in the frame before, as
// Lucas-Kanade is commonly checked, but with gain and bias. That tells highlights and edges, along which two ways
// differ, and asks for no correlation, which says more about texture than about the match. None where it ends nowhere.
[[nodiscard]] std::optional<double> off_on_way_back(const PatchTracker& tracker, const GreyImage& image,
                                                    const Vector2d& found_px, const WayThere& way) noexcept;

}  // namespace perimap
