// A JPEG's luma, by libjpeg.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/error/expected.hpp"

namespace perimap {

struct JpegSize {
  int width = 0;
  int height = 0;
};
// What its header says; the pixels are not looked at.
[[nodiscard]] Expected<JpegSize> read_jpeg_size(std::span<const std::byte> jpeg);

class JpegDecoder {
 public:
  JpegDecoder();
  JpegDecoder(JpegDecoder&&) noexcept;
  JpegDecoder& operator=(JpegDecoder&&) noexcept;
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;
  ~JpegDecoder();

  // Into rows of `width` bytes without gaps; `grey` holds width * height. Fails when the picture has another size, has
  // no luma (RGB, CMYK), or is damaged or cut short, where libjpeg would make pixels up; `grey` then means nothing.
  // Bytes between the picture's end, or a restart interval's, and the marker after it are let pass: cameras pad. So is
  // a missing end marker when no data are missing.
  [[nodiscard]] Expected<void> decode(std::span<const std::byte> jpeg, int width, int height,
                                      std::span<std::uint8_t> grey);

  // Its colours, reduced as colour_image.hpp says, into rows without gaps. Fails likewise, and when it is grey.
  [[nodiscard]] Expected<void> decode_reduced_colour(std::span<const std::byte> jpeg, int width, int height,
                                                     std::span<std::uint8_t> bgr);

  struct Impl;  // libjpeg's own

 private:
  struct Wanted {
    int width;
    int height;
    int samples;  // a pixel
  };
  [[nodiscard]] Expected<void> decode(std::span<const std::byte> jpeg, int width, int height, const Wanted& wanted,
                                      std::span<std::uint8_t> out);

  std::unique_ptr<Impl> impl_;
};

}  // namespace perimap
