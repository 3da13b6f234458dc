// The frame at full, half, quarter … resolution, made once a frame and shared by all that track in it.
#pragma once

#include <cstdint>
#include <vector>

#include "core/sensors/grey_image.hpp"

namespace perimap {

// A pixel (u, v) of the frame is at (u, v) / 2^l in level l: each level keeps the even pixels of the finer one after
// a binomial [1 4 6 4 1]/16 blur in both directions (Burt & Adelson 1983), with the border pixels repeated outside.
class ImagePyramid {
 public:
  static constexpr int kMaxLevels = 4;

  // For frames of width x height, both >= 1. levels counts level 0 and is clamped to [1, kMaxLevels]. All memory is
  // taken here.
  ImagePyramid(int width, int height, int levels);
  ImagePyramid(ImagePyramid&&) = default;
  ImagePyramid& operator=(ImagePyramid&&) = default;
  ImagePyramid(const ImagePyramid&) = delete;  // the levels point into this pyramid's own memory
  ImagePyramid& operator=(const ImagePyramid&) = delete;
  ~ImagePyramid() = default;

  // Level 0 borrows the frame, which must outlive the use of this pyramid (or its next build) and must have the size
  // given at construction; a frame of another size leaves the pyramid empty, with every level of size 0 x 0.
  void build(const GreyImage& frame) noexcept;

  [[nodiscard]] int levels() const noexcept { return static_cast<int>(sizes_.size()); }
  // l in [0, levels()).
  [[nodiscard]] GreyImage level(int l) const noexcept { return built_[static_cast<std::size_t>(l)]; }

 private:
  struct Size {
    int width;
    int height;
  };
  std::vector<Size> sizes_;
  std::vector<std::vector<std::uint8_t>> pixels_;  // of the levels above 0
  std::vector<std::uint16_t> row_;                 // one vertically blurred row with two pixels of margin each side
  std::vector<GreyImage> built_;
};

}  // namespace perimap
