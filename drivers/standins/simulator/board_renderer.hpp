// Renders what a scope sees of a calibration board on a table: an 8-bit grey image.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/pose.hpp"
#include "drivers/board/board_pattern.hpp"
#include "drivers/standins/simulator/field_stop.hpp"
#include "drivers/standins/simulator/lens.hpp"

namespace perimap {

class BoardRenderer {
 public:
  BoardRenderer(const ScopeLens& lens, const BoardPattern& pattern, const FieldStop& stop = {});

  // `noise_seed`: one value per frame. `image`: width * height places, row by row. A function of its arguments alone,
  // safe from several threads.
  void render(const Pose& X_CB, std::uint64_t noise_seed, std::span<std::uint8_t> image) const;

 private:
  void draw_pattern(const BoardPattern& pattern);
  [[nodiscard]] float ink_at(double x_mm, double y_mm) const noexcept;

  ScopeLens lens_;
  std::vector<float> ray_x_;  // per subsample, two a side of a pixel: the ray (x, y, 1)
  std::vector<float> ray_y_;
  std::vector<float> light_;  // per pixel: vignetting and field stop
  // The board with its white margin as light, texel by texel.
  double left_mm_ = 0.0, top_mm_ = 0.0, texels_per_mm_ = 0.0;
  int columns_ = 0, rows_ = 0;
  std::vector<float> texture_;
};

}  // namespace perimap
