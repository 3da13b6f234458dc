#include "core/vision/way_back.hpp"

#include <algorithm>

namespace perimap {

bool make_view(const GreyImage& image, const Vector2d& px, const PatchKernels& kernels, PatchTemplate& view) noexcept {
  TemplateSettings any_texture;
  any_texture.min_texture = any_texture.min_texture_coarse = 1e-3;
  any_texture.max_saturated_share = 1;
  if (make_patch_template(image, px, any_texture, kernels, view) != TemplateVerdict::kGood) return false;
  view.affine_usable = false;
  view.is_of_frame_before = true;
  return true;
}

std::optional<double> off_on_way_back(const PatchTracker& tracker, const GreyImage& image, const Vector2d& found_px,
                                      const WayThere& way) noexcept {
  PatchTemplate now;
  if (!make_view(image, found_px, tracker.kernels(), now)) return std::nullopt;
  PatchState state;
  // The way back begins without knowing where it should end: by the same prediction, as far off as that was.
  const Vector2d expected = way.from_px + (found_px - way.predicted_px);
  constexpr double kLeastDeviation_px = 2;
  const double deviation_px = std::max(way.deviation_px, kLeastDeviation_px);
  const PatchMatch back =
      tracker.track(way.before, now, state, expected, deviation_px * deviation_px * Matrix2d::Identity());
  if (back.state != MatchState::kFound) return std::nullopt;
  return (back.px - way.from_px).norm();
}

}  // namespace perimap
