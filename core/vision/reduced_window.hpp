// A part of the frame at a half or a quarter of its resolution, made where it is looked at and nowhere else.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/vision/patch_kernels.hpp"

namespace perimap {

// A pixel of level l is the mean of a block of 2^l x 2^l pixels of the frame, counted from the frame's corner; blocks
// that the frame cuts off are left out.
[[nodiscard]] inline Vector2d to_level(const Vector2d& px, int l) noexcept {
  const double scale = 1 << l;
  return (px + Vector2d::Constant(0.5)) / scale - Vector2d::Constant(0.5);
}
[[nodiscard]] inline Vector2d from_level(const Vector2d& px, int l) noexcept {
  const double scale = 1 << l;
  return scale * (px + Vector2d::Constant(0.5)) - Vector2d::Constant(0.5);
}

class ReducedWindow {
 public:
  static constexpr int kMaxReach = 40;  // level pixels

  // The pixels of level 1 or 2 within `reach` of `centre` (level pixels) along each axis, as far as the frame goes;
  // none when that is nowhere.
  ReducedWindow(const GreyImage& frame, int level, const Vector2d& centre, double reach,
                const PatchKernels& kernels) noexcept;

  // In coordinates of its own; add origin() for those of the level.
  [[nodiscard]] GreyImage image() const noexcept { return {pixels_, width_, height_, width_}; }
  [[nodiscard]] const Vector2d& origin() const noexcept { return origin_; }

 private:
  static constexpr int kMaxSide = 2 * kMaxReach + 2;
  int width_ = 0;
  int height_ = 0;
  Vector2d origin_ = Vector2d::Zero();
  std::uint8_t pixels_[static_cast<std::size_t>(kMaxSide) * kMaxSide];
};

}  // namespace perimap
