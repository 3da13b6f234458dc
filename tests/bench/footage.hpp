// Short image sequences in which the motion of every feature is known.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap::bench {

struct Footage {
  std::string name;
  int width = 0;
  int height = 0;
  std::vector<std::vector<std::uint8_t>> frames;
  std::vector<std::vector<Vector2d>> px;  // [frame][feature], true

  [[nodiscard]] GreyImage image(std::size_t frame) const { return {frames[frame].data(), width, height, width}; }
};

// The simulator's beating heart from a hand-held scope at 30 frames/s, with its sensor noise.
[[nodiscard]] Footage rendered_footage(int width, int height, int frames, int features);

// A tissue-like texture (1/f, with sharp vessels) under a smooth deformation and a moving view, drawn three
// times as fine as the pixels, with vignetting and the noise of the simulator's sensor, 1.2 grey levels.
[[nodiscard]] Footage textured_footage(int width, int height, int frames, int features);

// The same with a light that changes from frame to frame: gain within +-6 %, bias within +-4 grey levels.
[[nodiscard]] Footage under_changing_light(const Footage& footage);

}  // namespace perimap::bench
