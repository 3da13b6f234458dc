// What is drawn over the radiance of a picture: grey levels, row by row. Functions of their arguments alone.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

struct ShaftPlace {
  Vector2d from = Vector2d::Zero();  // beyond the border, px
  Vector2d tip = Vector2d::Zero();
  double half_width_px = 0.0;

  [[nodiscard]] bool covers(const Vector2d& px, double margin_px) const noexcept;
};

class ViewDrawing {
 public:
  ViewDrawing(int width, int height) noexcept : width_(width), height_(height) {}

  // A cylinder of brushed steel: bright along a line, darker towards its sides.
  void shaft(const ShaftPlace& place, std::span<float> radiance) const;
  // Scatters the scope's own light back, and dims what lies behind (Koschmieder's law). Clouds are a sum of drifting
  // waves, smooth enough to be worked out on a coarse grid; `strength` is the optical depth of the thickest.
  void clouds(std::uint64_t seed, double strength, double t_s, std::span<float> radiance) const;
  // Likewise of one optical depth everywhere, which blurs as well.
  void fog(double depth, std::vector<float>& scratch, std::span<float> radiance) const;
  // Opaque drops and a pool that run in from a side, over such a share of the picture.
  void blood(std::uint64_t seed, double share, std::span<float> radiance) const;
  // A pattern of another thing in the place of such a share of the light: a cloth that is drawn past, a trocar's wall.
  void cloth(double share, double t_s, std::span<float> radiance) const;
  void trocar(double share, std::span<float> radiance) const;
  // Stripes along the rows, as an electric arc makes in a camera's lines; others in each picture.
  void bands(std::uint64_t seed, double levels, std::span<float> radiance) const;

 private:
  [[nodiscard]] std::size_t at(int row, int column) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(column);
  }

  int width_;
  int height_;
};

}  // namespace perimap
