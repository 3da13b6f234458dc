// What a feature looks like: small windows of its first view at several resolutions, with all that alignment needs
// from them made once.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

struct PatchKernels;

// Alignment with gain and bias: an image patch I is modelled as gain * T(warp) + bias. The steepest-descent images are
// made orthogonal to the constant 1 and to T, so that gain and bias drop out of the normal equations exactly (the
// "project out" form of Baker, Gross & Matthews, "Lucas-Kanade 20 Years On: Part 3", CMU-RI-TR-03-35, 2003).
// "SD" below is the steepest-descent image of one warp parameter, "projected" means so orthogonalised.
struct PatchTemplate {
  // Level l has a 2^l-th of the frame's resolution (reduced_window.hpp).
  static constexpr int kLevels = 3;
  // Window sides in pixels of their own level: 3 mm of tissue at level 0 in a common view; the coarse windows span up
  // to twice that.
  static constexpr std::array<int, kLevels> kSide = {21, 15, 11};
  static constexpr int kReach = kSide[0] / 2;      // of the first level, px from its middle pixel
  static constexpr std::size_t kMaxSamples = 448;  // 21 x 21, row after row, then zeros up to a multiple of 32
  using Pixels = std::array<std::int16_t, kMaxSamples>;
  // Grey values are kept less this one, so that sums over a window are small, and times the other.
  static constexpr int kGreyOrigin = 128;
  static constexpr int kGreyScale = 16;

  // Sobel's operator smooths across the derivative: image noise makes the Hessian of plain differences too large.
  static constexpr double kGradientScale = 8;

  // Parameters of the warp d -> d + t + M d, d in level pixels from the feature: t_x t_y m_xx m_xy m_yx m_yy.
  static constexpr int kParameters = 6;

  struct Level {
    bool usable = false;  // false: too near the border or without texture at this level
    int side = 0;
    double offset_x = 0, offset_y = 0;  // of the feature from the window's middle pixel, level pixels, |.| <= 0.5
    double mean = 0;                    // of T - kGreyOrigin, grey levels
    double sum_squares = 0;             // sum of (T - its mean)^2
    std::array<double, kParameters> sd_mean{};     // mean of SD_k
    std::array<double, kParameters> sd_on_grey{};  // sum of SD_k (T - mean) / sum_squares
    std::array<double, 4> translation_inverse{};   // inverse of the projected 2x2 Hessian, row by row
    // kGreyScale (T - kGreyOrigin), rounded. T is smoothed as the image is where it is sampled (patch_kernels.hpp):
    // else each match would see it blurred and take it for larger, and what lies beside the feature would pull it
    // along.
    alignas(64) Pixels value{};
    alignas(64) Pixels gradient_x{};  // kGradientScale times it, by Sobel's operator
    alignas(64) Pixels gradient_y{};

    [[nodiscard]] int half() const noexcept { return side / 2; }
  };

  // Of level 0: gradient_x times column and row, gradient_y times column and row, both counted from the window's middle
  // pixel, over kMomentDivisor, which keeps their sums with any image within 32 bits.
  static constexpr int kMomentDivisor = 4;
  alignas(64) std::array<Pixels, 4> gradient_moments{};

  std::array<Level, kLevels> levels;
  bool is_of_frame_before = false;  // and so as noisy as the image that it is held against, and looks like it
  bool affine_usable = false;       // level 0 determines all six parameters
  std::array<double, kParameters * kParameters> affine_inverse{};  // inverse of level 0's projected Hessian
};

enum class TemplateVerdict : std::uint8_t {
  kGood,
  kTooNearBorder,     // or not finite, or no image: the level-0 window and one pixel around it must lie in the frame
  kTooLittleTexture,  // some direction of motion would hardly change the patch
  kSaturated,         // a highlight or a clipped area, which does not move with the tissue
};

struct TemplateSettings {
  // The smaller eigenvalue of the projected Hessian over the number of pixels, (grey levels / px)^2. Image noise of
  // sigma grey levels alone gives 0.19 sigma^2.
  double min_texture = 5.0;
  double min_texture_coarse = 2.0;  // above level 0, where the blur has taken the noise away
  int saturated_grey = 250;         // at or above this a pixel is clipped
  double max_saturated_share = 0.03;
};

// Makes the template of the feature at px (level-0 pixels, need not be whole: windows stay on the pixel grid and carry
// the offset, so nothing is interpolated). out is meaningful with kGood only.
[[nodiscard]] TemplateVerdict make_patch_template(const GreyImage& image, const Vector2d& px,
                                                  const TemplateSettings& settings, const PatchKernels& kernels,
                                                  PatchTemplate& out) noexcept;

}  // namespace perimap
