#include "core/vision/image_pyramid.hpp"

#include <algorithm>

namespace perimap {
namespace {

constexpr int kMargin = 2;  // pixels, the reach of the blur

// One vertically blurred row, 16 times the grey value: at most 4080.
void blur_column(const std::uint8_t* r0, const std::uint8_t* r1, const std::uint8_t* r2, const std::uint8_t* r3,
                 const std::uint8_t* r4, int width, std::uint16_t* out) noexcept {
  for (int x = 0; x < width; ++x) {
    out[x] = static_cast<std::uint16_t>(r0[x] + r4[x] + 4 * (r1[x] + r3[x]) + 6 * r2[x]);
  }
}

// The horizontal blur of the even pixels. in points at pixel 0 and has kMargin pixels on both sides.
void blur_and_halve_row(const std::uint16_t* in, int out_width, std::uint8_t* out) noexcept {
  for (int x = 0; x < out_width; ++x) {
    const std::uint16_t* p = in + 2 * x;
    out[x] = static_cast<std::uint8_t>((p[-2] + p[2] + 4 * (p[-1] + p[1]) + 6 * p[0] + 128) >> 8);
  }
}

}  // namespace

ImagePyramid::ImagePyramid(int width, int height, int levels) {
  Size size{std::max(width, 1), std::max(height, 1)};
  const int count = std::clamp(levels, 1, kMaxLevels);
  for (int l = 0; l < count; ++l) {
    sizes_.push_back(size);
    if (l > 0) pixels_.emplace_back(static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height));
    size = {(size.width + 1) / 2, (size.height + 1) / 2};
  }
  row_.resize(static_cast<std::size_t>(sizes_.front().width) + 2 * kMargin);
  built_.resize(sizes_.size());
}

void ImagePyramid::build(const GreyImage& frame) noexcept {
  if (frame.data == nullptr || frame.width != sizes_[0].width || frame.height != sizes_[0].height) {
    std::fill(built_.begin(), built_.end(), GreyImage{});
    return;
  }
  built_[0] = frame;
  for (std::size_t l = 1; l < sizes_.size(); ++l) {
    const GreyImage& fine = built_[l - 1];
    const Size size = sizes_[l];
    std::uint8_t* const coarse = pixels_[l - 1].data();
    std::uint16_t* const row = row_.data() + kMargin;
    const auto fine_row = [&fine](int y) { return fine.row(std::clamp(y, 0, fine.height - 1)); };
    for (int y = 0; y < size.height; ++y) {
      blur_column(fine_row(2 * y - 2), fine_row(2 * y - 1), fine_row(2 * y), fine_row(2 * y + 1), fine_row(2 * y + 2),
                  fine.width, row);
      std::fill_n(row - kMargin, kMargin, row[0]);
      std::fill_n(row + fine.width, kMargin, row[fine.width - 1]);
      blur_and_halve_row(row, size.width, coarse + static_cast<std::ptrdiff_t>(y) * size.width);
    }
    built_[l] = {coarse, size.width, size.height, size.width};
  }
}

}  // namespace perimap
