// A look in numbers: how a surface shines and what the camera makes of it.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "core/time/instant.hpp"
#include "drivers/standins/simulator/look.hpp"
#include "drivers/standins/simulator/tissue.hpp"

namespace perimap {

// A spherical Gaussian about the mirror direction.
struct HighlightLobe {
  float strength, sharpness;
};

struct PictureLook {
  TissueSample (*tissue)(const Eigen::Vector3f& p_mm, std::uint32_t seed) noexcept;

  float white_grey;    // of a white surface under full light
  float even_light;    // share of the diffuse light that falls on the surface without its bumps
  float bumpy_light;   // and on that with them
  HighlightLobe film;  // what is wet
  HighlightLobe tissue_below;
  float off_mirror_most;  // beyond it neither lobe is computed: 1 - cos of the angle
  bool film_flows;        // the film's bumps are not fixed to the tissue (FrameLight::film)
  double vignetting;      // power of the cosine of the angle to the axis

  float blur_side;            // the blur: [s 1-2s s] along rows and columns, a standard deviation of sqrt(2 s) px
  double exposure_deviation;  // of each picture, relative
  float read_variance;        // grey levels^2
  float shot_levels;          // grey levels at which the shot noise has a deviation of 1
};

[[nodiscard]] PictureLook picture_look(Look look) noexcept;

// What of the light changes from picture to picture.
struct FrameLight {
  Eigen::Vector2f film = Eigen::Vector2f::Zero();  // how far the film has flowed, in widths of the chart
  float gain = 1.0F;                               // exposure, by the camera's own control
  float veil = 0.0F;                               // stray light, grey levels
};

// A function of its arguments alone; of Look::kRendered always the same.
[[nodiscard]] FrameLight frame_light(Look look, std::uint64_t seed, Duration since_start) noexcept;

}  // namespace perimap
