// The inner loops over the pixels of a patch, in integers, compiled for several instruction sets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/simd/simd_target.hpp"
#include "core/vision/patch_template.hpp"

namespace perimap {

// A window seen in the image, as a template's values are: PatchTemplate::kGreyScale (I - PatchTemplate::kGreyOrigin) in
// 16 bits, rounded, row after row, zeros behind.
//
// Between pixels I is the quadratic B-spline of the nearest three in each direction. It smooths alike wherever it is
// sampled (its variance is 1/4 px^2 everywhere; M. Unser, "Splines: a perfect fit", IEEE Signal Processing Magazine
// 16(6), 1999). Bilinear interpolation smooths by 0 to 1/4, and a template that is sharper than what it is held against
// looks the larger the sharper it is.
struct PatchSamples {
  static constexpr std::size_t kRoom = PatchTemplate::kMaxSamples + 32;  // whole vectors are stored
  alignas(64) std::array<std::int16_t, kRoom> grey;
};

// Of the window's pixels with the template's, in the units of the samples. All fit 32 bits for any image
// (Cauchy-Schwarz on the largest values of 441 pixels); the order of summation does not change them.
struct PatchSums {
  std::int32_t grey = 0;
  std::int32_t grey_squared = 0;
  std::int32_t with_template = 0;
  std::int32_t with_gradient_x = 0;
  std::int32_t with_gradient_y = 0;
  std::array<std::int32_t, 4> with_moments{};  // of sum_affine alone
};

// Where the pixel (column, row) of a window lies in the image: first + column * per_column + row * per_row.
struct WindowGrid {
  Vector2d first;
  Vector2d per_column;
  Vector2d per_row;
};

// What a search compares: the template on whole pixels, weights 0 or -1 (all bits), rows kStride apart.
struct SearchPattern {
  static constexpr int kStride = 32;
  static constexpr int kMaxSide = 21;
  int side = 0;
  alignas(64) std::array<std::int16_t, kMaxSide * kStride> value{};
  alignas(64) std::array<std::int16_t, kMaxSide * kStride> mask{};
};
struct SearchSums {
  std::int32_t grey = 0;
  std::int32_t grey_squared = 0;
  std::int32_t with_value = 0;
};

// The same results on every instruction set. None of them reads outside the image's rows (of width pixels, stride
// apart, counted as one block of memory from the first to the last pixel).
struct PatchKernels {
  // On a grid of the image's own orientation: first + (column, row). Every place of it must be at least kBefore from
  // the image's left and upper edge pixels and kBehind from the others.
  static constexpr int kBefore = 1, kBehind = 3;  // four bytes are read where three pixels are needed
  void (*sample_shifted)(const GreyImage& image, int side, const Vector2d& first, PatchSamples& samples) noexcept;
  // On any grid; the same holds.
  void (*sample_warped)(const GreyImage& image, int side, const WindowGrid& grid, PatchSamples& samples) noexcept;
  void (*sum)(const PatchTemplate::Level& level, const PatchSamples& samples, PatchSums& sums) noexcept;
  void (*sum_affine)(const PatchTemplate& patch, const PatchSamples& samples, PatchSums& sums) noexcept;
  // `first`: the window's first pixel in an array whose rows are `stride` apart and reach 32 values beyond it.
  void (*correlate)(const SearchPattern& pattern, const std::int16_t* first, int stride, SearchSums& sums) noexcept;
  // Means of blocks of 2^level x 2^level pixels (level 1 or 2), width x height of them from block (left, top) on,
  // rounded. All must be in the image.
  void (*reduce)(const GreyImage& image, int level, int left, int top, int width, int height,
                 std::uint8_t* out) noexcept;
};

[[nodiscard]] const PatchKernels& patch_kernels(SimdTarget target);

}  // namespace perimap
