// Inverse-compositional alignment of a template level with an image, gain and bias included.
#pragma once

#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/vision/patch_kernels.hpp"
#include "core/vision/patch_template.hpp"

namespace perimap {

// The window pixel at d (level pixels from the feature, in the template) is sought at centre + A d in the image.
struct PatchWarp {
  Vector2d centre;  // level pixels
  Matrix2d A;
};

enum class Alignment : std::uint8_t {
  kConverged,
  kOutOfView,  // the warped window leaves the image
  kDiverged,   // it left its neighbourhood, turned into a negative image, or did not come to rest
};

struct AlignmentResult {
  Alignment outcome = Alignment::kDiverged;
  double correlation = 0;  // zero-mean normalised, [-1, 1], of the aligned window
  double gain = 1;         // I = gain * T + bias, grey levels
  double bias = 0;
  // Of I - gain * T - bias, grey levels^2 per pixel, as it acts on a patch: from sums over blocks of 3 x 3 pixels,
  // which keep what neighbouring pixels have in common (shading, a highlight's edge) and what interpolation takes off
  // single pixels. Where the alignment has ended at level 0 and it was asked for; 0 otherwise.
  double residual_variance = 0;
};

// Whether every pixel of the warped window can be interpolated in the image. False for anything not finite.
[[nodiscard]] bool warped_window_fits(const GreyImage& image, const PatchTemplate::Level& level,
                                      const PatchWarp& warp) noexcept;

struct AlignmentLimits {
  int max_iterations = 10;
  double at_rest = 0.01;  // level pixels: a step below this ends the iteration
  double max_travel = 4;  // level pixels from the start of the iteration
  bool wants_residual = false;
  // The gain that moves the warp is the ratio of the windows' deviations instead of that by least squares, which the
  // template's noise makes too small: for a template that is as noisy as the image.
  bool gain_is_ratio = false;
};

// Moves warp.centre only. level must be usable.
[[nodiscard]] AlignmentResult align_translation(const GreyImage& image, const PatchTemplate::Level& level,
                                                const AlignmentLimits& limits, const PatchKernels& kernels,
                                                PatchWarp& warp) noexcept;

// Moves all six parameters at level 0; needs patch.affine_usable.
[[nodiscard]] AlignmentResult align_affine(const GreyImage& image, const PatchTemplate& patch,
                                           const AlignmentLimits& limits, const PatchKernels& kernels,
                                           PatchWarp& warp) noexcept;

}  // namespace perimap
