#include "drivers/image/jpeg_encoder.hpp"

#include <fmt/format.h>

#include <csetjmp>
#include <cstdio>
#include <cstdlib>
// After cstdio, which it needs and does not include.
#include <jpeglib.h>

#include <array>

namespace perimap {
namespace {

// NOLINTBEGIN(cert-err52-cpp): longjmp is the library's way out of an error; only C frames and trivial locals are left
struct Encoder {
  jpeg_error_mgr errors{};
  jpeg_compress_struct jpeg{};
  std::jmp_buf on_error{};
  std::array<char, JMSG_LENGTH_MAX> message{};
  unsigned char* bytes = nullptr;
  unsigned long size = 0;

  Encoder() = default;
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;
  ~Encoder() {
    jpeg_destroy_compress(&jpeg);
    std::free(bytes);  // NOLINT(cppcoreguidelines-no-malloc): the library's
  }

  // False: `message` says why not.
  bool encode(const GreyImage& image, int quality) {
    jpeg.err = jpeg_std_error(&errors);
    jpeg.client_data = this;
    errors.error_exit = [](j_common_ptr common) {
      Encoder& self = *static_cast<Encoder*>(common->client_data);
      common->err->format_message(common, self.message.data());
      std::longjmp(self.on_error, 1);
    };
    if (setjmp(on_error) != 0) return false;
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &bytes, &size);
    jpeg.image_width = static_cast<JDIMENSION>(image.width);
    jpeg.image_height = static_cast<JDIMENSION>(image.height);
    jpeg.input_components = 1;
    jpeg.in_color_space = JCS_GRAYSCALE;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, quality, TRUE);
    jpeg.dct_method = JDCT_FASTEST;
    jpeg_start_compress(&jpeg, TRUE);
    for (int y = 0; y < image.height; ++y) {
      // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast): the library's type lacks the const; it only reads
      JSAMPROW row = const_cast<JSAMPROW>(image.data + y * image.stride);
      (void)jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    return true;
  }
};
// NOLINTEND(cert-err52-cpp)

}  // namespace

Expected<std::string> encode_jpeg(const GreyImage& image, int quality) {
  if (image.data == nullptr || image.width <= 0 || image.height <= 0) return fail("a picture without pixels");
  Encoder encoder;
  if (!encoder.encode(image, quality)) return fail(fmt::format("no JPEG: {}", encoder.message.data()));
  return std::string(reinterpret_cast<const char*>(encoder.bytes), encoder.size);
}

}  // namespace perimap
