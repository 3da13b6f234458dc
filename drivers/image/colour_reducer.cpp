#include "drivers/image/colour_reducer.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace perimap {
namespace {

// Where a row's samples lie: luma of each pixel, chroma of every two of them.
struct RowSamples {
  const std::uint8_t* y;
  const std::uint8_t* u;
  const std::uint8_t* v;
  int y_step;
  int uv_step;
};

RowSamples samples_of_row(const CameraFrame& frame, int row) noexcept {
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(frame.bytes.data());
  const auto at = [&](int r) { return bytes + static_cast<std::size_t>(r) * frame.stride; };
  const std::uint8_t* const first = at(row);
  if (frame.format == PixelFormat::kYuyv) return {first, first + 1, first + 3, 2, 4};
  if (frame.format == PixelFormat::kUyvy) return {first + 1, first, first + 2, 2, 4};
  const std::uint8_t* const chroma = at(frame.height + row / 2);
  return {first, chroma, chroma + 1, 1, 2};
}

std::uint8_t to_byte(double value) noexcept { return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0)); }

// ITU-R BT.601, limited range: what a camera's video formats are unless they say otherwise.
std::array<std::uint8_t, 3> to_bgr(double y, double u, double v) noexcept {
  const double light = 255.0 / 219.0 * (y - 16), blue = 255.0 / 224.0 * (u - 128), red = 255.0 / 224.0 * (v - 128);
  return {to_byte(light + 1.772 * blue), to_byte(light - 0.344 * blue - 0.714 * red), to_byte(light + 1.402 * red)};
}

// The two rows in the middle of each block will do.
void reduce_video(const CameraFrame& frame, std::uint8_t* out) noexcept {
  static_assert(kColourReduction == 4, "a block is two pairs of pixels wide");
  constexpr int kRows = 2, kPairs = 2;
  const int last_pair = (frame.width - 1) / 2;
  for (int by = 0; by < reduced_side(frame.height); ++by) {
    std::array<RowSamples, kRows> rows{};
    for (int i = 0; i < kRows; ++i) {
      rows[static_cast<std::size_t>(i)] =
          samples_of_row(frame, std::min(kColourReduction * by + 1 + i, frame.height - 1));
    }
    for (int bx = 0; bx < reduced_side(frame.width); ++bx, out += 3) {
      int y = 0, u = 0, v = 0;
      for (const RowSamples& row : rows) {
        for (int i = 0; i < kPairs; ++i) {
          const int pair = std::min(kPairs * bx + i, last_pair);
          y += row.y[2 * pair * row.y_step] + row.y[std::min(2 * pair + 1, frame.width - 1) * row.y_step];
          u += row.u[pair * row.uv_step];
          v += row.v[pair * row.uv_step];
        }
      }
      constexpr double kChroma = 1.0 / (kRows * kPairs), kLuma = kChroma / 2;
      const auto bgr = to_bgr(kLuma * y, kChroma * u, kChroma * v);
      std::copy(bgr.begin(), bgr.end(), out);
    }
  }
}

// Likewise, all pixels of them. False for a picture of another size.
bool reduce_decoded(const CameraFrame& frame, std::uint8_t* out) noexcept {
  constexpr int kRows = 2;
  const ColourImage& colour = frame.colour;
  if (colour.width != frame.width || colour.height != frame.height) return false;
  for (int by = 0; by < reduced_side(frame.height); ++by) {
    for (int bx = 0; bx < reduced_side(frame.width); ++bx, out += 3) {
      std::array<int, 3> sums{};
      for (int i = 0; i < kRows; ++i) {
        const std::uint8_t* const row = colour.row(std::min(kColourReduction * by + 1 + i, frame.height - 1));
        for (int k = 0; k < kColourReduction; ++k) {
          const std::uint8_t* const pixel =
              row + std::ptrdiff_t{3} * std::min(kColourReduction * bx + k, frame.width - 1);
          for (std::size_t channel = 0; channel < sums.size(); ++channel) sums[channel] += pixel[channel];
        }
      }
      for (std::size_t channel = 0; channel < sums.size(); ++channel) {
        out[channel] = static_cast<std::uint8_t>(sums[channel] / (kRows * kColourReduction));
      }
    }
  }
  return true;
}

}  // namespace

void ColourReducer::reserve(int width, int height) {
  bgr_.resize(reduced_row_bytes(width) * static_cast<std::size_t>(reduced_side(height)));
}

void ColourReducer::reduce_colour(const CameraFrame& frame) {
  picture_ = {};
  rate_.add(frame.stamp.capture);
  if (any_ && ++passed_over_ < rate_.rate().frames(interval_)) return;
  any_ = true;
  passed_over_ = 0;
  if (!reduce(frame)) return;
  picture_ = {bgr_.data(), reduced_side(frame.width), reduced_side(frame.height),
              static_cast<std::ptrdiff_t>(reduced_row_bytes(frame.width))};
}

bool ColourReducer::reduce(const CameraFrame& frame) {
  const bool is_decoded = frame.colour.bgr != nullptr;
  if ((frame.format == PixelFormat::kGrey && !is_decoded) || !check_bytes(frame)) return false;
  const std::size_t bytes = reduced_row_bytes(frame.width) * static_cast<std::size_t>(reduced_side(frame.height));
  if (bgr_.size() < bytes) bgr_.resize(bytes);
  if (is_decoded) return reduce_decoded(frame, bgr_.data());
  if (frame.format == PixelFormat::kMjpg) {
    return jpeg_.decode_reduced_colour(frame.bytes, frame.width, frame.height, bgr_).has_value();
  }
  reduce_video(frame, bgr_.data());
  return true;
}

}  // namespace perimap
