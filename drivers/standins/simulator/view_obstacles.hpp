// What comes between the scope and the heart in the picture: an instrument's shaft, glints on the wet film, smoke.
#pragma once

#include <cstdint>
#include <span>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// A function of its arguments alone. Places are in the image: an obstacle is not part of the scene's geometry.
class ViewObstacles {
 public:
  // `instrument`: a grey shaft that comes in from the border every 6 s for 3 s, each time from another side. `glints`:
  // so many clipped spots, which wander over the tissue and go on and off. `smoke`: drifting clouds that come every 8 s
  // for 5 s; optical depth of the thickest, 1 leaves 37 % of the contrast.
  ViewObstacles(std::uint64_t seed, int width, int height, bool instrument, int glints, double smoke);

  // Adds them to the radiance of a picture (grey levels, row by row), time since the session's start.
  void draw(Duration since_start, std::span<float> radiance) const;

  // Whether the instrument, or a margin about it, lies over a pixel.
  [[nodiscard]] bool instrument_covers(const Vector2d& px, Duration since_start, double margin_px) const noexcept;

 private:
  struct Shaft {
    bool is_in_view = false;
    Vector2d from = Vector2d::Zero();  // beyond the border, px
    Vector2d tip = Vector2d::Zero();
  };
  [[nodiscard]] Shaft shaft(double t_s) const noexcept;
  void draw_shaft(double t_s, std::span<float> radiance) const;
  void draw_glints(double t_s, std::span<float> radiance) const;
  void draw_smoke(double t_s, std::span<float> radiance) const;

  std::uint64_t seed_;
  int width_;
  int height_;
  bool instrument_;
  int glints_;
  double smoke_;
  double half_width_px_;  // of the shaft
};

}  // namespace perimap
