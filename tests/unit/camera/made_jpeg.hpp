// JPEGs as cameras send them, for tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
// After cstdio, which it needs and does not include.
#include <jpeglib.h>

#include <cstdlib>
#include <functional>
#include <span>
#include <vector>

namespace perimap::test {

using Luma = std::function<std::uint8_t(int x, int y)>;

// Colour, 4:2:2 as from a UVC camera, or grey; or progressive, as from none. Restart markers each so many blocks, or
// none.
inline std::vector<std::byte> make_jpeg(int width, int height, const Luma& luma, bool colour = true,
                                        bool progressive = false, unsigned restart_interval = 0) {
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &bytes, &size);
  jpeg.image_width = static_cast<JDIMENSION>(width);
  jpeg.image_height = static_cast<JDIMENSION>(height);
  jpeg.input_components = colour ? 3 : 1;
  jpeg.in_color_space = colour ? JCS_YCbCr : JCS_GRAYSCALE;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 95, TRUE);
  if (colour) jpeg.comp_info[0].v_samp_factor = 1;
  jpeg.restart_interval = restart_interval;
  if (progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(width) * (colour ? 3U : 1U), 90);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) row[static_cast<std::size_t>(x) * (colour ? 3U : 1U)] = luma(x, y);
    JSAMPROW rows = row.data();
    jpeg_write_scanlines(&jpeg, &rows, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  const auto whole = std::as_bytes(std::span(bytes, size));
  std::vector<std::byte> result(whole.begin(), whole.end());
  std::free(bytes);  // NOLINT(cppcoreguidelines-no-malloc): the library's own malloc
  return result;
}

// Without its Huffman tables, as many UVC cameras send them.
inline std::vector<std::byte> without_tables(const std::vector<std::byte>& jpeg) {
  const auto byte = [&jpeg](std::size_t i) { return std::to_integer<unsigned>(jpeg.at(i)); };
  std::vector<std::byte> result(jpeg.begin(), jpeg.begin() + 2);
  for (std::size_t at = 2;;) {
    const std::size_t length = 2 + byte(at + 2) * 256 + byte(at + 3);
    const auto begin = jpeg.begin() + static_cast<std::ptrdiff_t>(at);
    constexpr unsigned kHuffmanTables = 0xC4;
    constexpr unsigned kScan = 0xDA;
    if (byte(at + 1) == kScan) {
      result.insert(result.end(), begin, jpeg.end());
      return result;
    }
    if (byte(at + 1) != kHuffmanTables) result.insert(result.end(), begin, begin + static_cast<std::ptrdiff_t>(length));
    at += length;
  }
}

}  // namespace perimap::test
