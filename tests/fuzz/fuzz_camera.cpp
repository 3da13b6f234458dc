// Any bytes as a camera's frame, in any of its formats and sizes: a picture of that size, or an error; and its colour.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "drivers/image/colour_reducer.hpp"
#include "drivers/image/grey_converter.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  constexpr std::size_t kHead = 4;
  if (size < kHead) return 0;
  // One converter over all inputs: nothing of an input may be left in it.
  static GreyConverter converter;
  CameraFrame frame;
  frame.bytes = std::as_bytes(std::span(data, size).subspan(kHead));
  frame.format = static_cast<PixelFormat>(data[0] % 5);
  frame.width = data[1];
  frame.height = data[2];
  frame.stride = row_bytes(frame.format, frame.width) + data[3] % 8U - (data[3] > 250 ? 1 : 0);
  if (frame.format == PixelFormat::kMjpg) {
    const auto announced = read_jpeg_size(frame.bytes);
    // As a replay takes it; but for what would only take long.
    if (announced && data[3] % 2 == 0 && std::int64_t{announced->width} * announced->height < 1 << 16) {
      frame.width = announced->width;
      frame.height = announced->height;
    }
  }
  static ColourReducer kept(Duration(0));
  ColourReducer fresh(Duration(0));  // whose room is the picture's own, so that nothing behind it is missed
  ColourReducer& reducer = data[3] / 128 == 0 ? kept : fresh;
  reducer.reduce_colour(frame);
  const ColourImage& colour = reducer.picture();
  const bool has_colour =
      frame.format == PixelFormat::kYuyv || frame.format == PixelFormat::kUyvy || frame.format == PixelFormat::kNv12;
  if (has_colour && check_bytes(frame) && colour.bgr == nullptr) std::abort();
  if (colour.bgr != nullptr &&
      (colour.width != reduced_side(frame.width) || colour.height != reduced_side(frame.height))) {
    std::abort();
  }
  unsigned colours = 0;
  for (int y = 0; y < colour.height; ++y) {
    for (int i = 0; i < 3 * colour.width; ++i) colours += colour.row(y)[i];
  }
  // Never so; the question makes them be read.
  if (colours > 255U * 3U * static_cast<unsigned>(colour.width * colour.height)) std::abort();
  const auto image = converter.convert(frame);
  if (!image) return 0;
  if (image->width != frame.width || image->height != frame.height || image->stride < image->width) std::abort();
  unsigned sum = 0;
  for (int y = 0; y < image->height; ++y) {
    for (int x = 0; x < image->width; ++x) sum += image->row(y)[x];
  }
  // More than white everywhere can only come from beside the picture; without the question nothing would be read.
  if (sum > 255U * static_cast<unsigned>(image->width * image->height)) std::abort();
  return 0;
}
