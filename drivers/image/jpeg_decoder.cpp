#include "drivers/image/jpeg_decoder.hpp"

#include <fmt/format.h>

#include <csetjmp>
#include <cstdio>
// After cstdio, which it needs and does not include.
#include <jerror.h>
#include <jpeglib.h>

#include <array>
#include <new>

namespace perimap {

// NOLINTBEGIN(cert-err52-cpp): longjmp is the library's way out of an error; only C frames and trivial locals are left
struct JpegDecoder::Impl {
  jpeg_error_mgr errors{};
  jpeg_decompress_struct jpeg{};
  std::jmp_buf on_error{};
  std::array<char, JMSG_LENGTH_MAX> message{};

  Impl() {
    jpeg.err = jpeg_std_error(&errors);
    jpeg.client_data = this;
    errors.error_exit = [](j_common_ptr common) {
      Impl& self = of(common);
      common->err->format_message(common, self.message.data());
      std::longjmp(self.on_error, 1);
    };
    errors.emit_message = [](j_common_ptr common, int level) {
      // -1 is a warning: the data was damaged, and the library goes on with what it can make of it.
      if (level >= 0) return;
      // The second number is the marker.
      // NOLINTNEXTLINE(cppcoreguidelines-pro-type-union-access): the library's own type
      const bool before_end = common->err->msg_parm.i[1] == JPEG_EOI;
      if (common->err->msg_code == JWRN_EXTRANEOUS_DATA && before_end) return;
      common->err->error_exit(common);
    };
    if (setjmp(on_error) != 0) throw std::bad_alloc();
    jpeg_create_decompress(&jpeg);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { jpeg_destroy_decompress(&jpeg); }

  static Impl& of(j_common_ptr common) { return *static_cast<Impl*>(common->client_data); }

  // Null when it is done; otherwise what is wrong.
  const char* read_size(std::span<const std::byte> bytes, JpegSize& size) {
    if (setjmp(on_error) != 0) {
      jpeg_abort_decompress(&jpeg);
      return message.data();
    }
    read_header(bytes);
    size = {static_cast<int>(jpeg.image_width), static_cast<int>(jpeg.image_height)};
    jpeg_abort_decompress(&jpeg);
    return nullptr;
  }

  void read_header(std::span<const std::byte> bytes) {
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast): libjpeg 6's type lacks the const; it only reads
    auto* data = const_cast<unsigned char*>(reinterpret_cast<const unsigned char*>(bytes.data()));
    jpeg_mem_src(&jpeg, data, bytes.size());
    (void)jpeg_read_header(&jpeg, TRUE);
  }

  // Null when it is done; otherwise what is wrong. Its locals are trivial, since a longjmp runs no destructors.
  const char* decode(std::span<const std::byte> bytes, int width, int height, std::uint8_t* grey) {
    if (setjmp(on_error) != 0) {
      jpeg_abort_decompress(&jpeg);
      return message.data();
    }
    read_header(bytes);
    const bool luma = jpeg.jpeg_color_space == JCS_YCbCr || jpeg.jpeg_color_space == JCS_GRAYSCALE;
    if (!luma || jpeg.image_width != static_cast<JDIMENSION>(width) ||
        jpeg.image_height != static_cast<JDIMENSION>(height)) {
      const char* const wrong = luma ? "another size than announced" : "no luma";
      jpeg_abort_decompress(&jpeg);
      return wrong;
    }
    if (jpeg.progressive_mode != FALSE) {
      // No camera sends it, and its scans can make a small file take minutes.
      jpeg_abort_decompress(&jpeg);
      return "progressive";
    }
    jpeg.out_color_space = JCS_GRAYSCALE;
    (void)jpeg_start_decompress(&jpeg);
    while (jpeg.output_scanline < jpeg.output_height) {
      JSAMPROW row = grey + std::size_t{jpeg.output_scanline} * jpeg.output_width;
      (void)jpeg_read_scanlines(&jpeg, &row, 1);
    }
    (void)jpeg_finish_decompress(&jpeg);
    return nullptr;
  }
};
// NOLINTEND(cert-err52-cpp)

Expected<JpegSize> read_jpeg_size(std::span<const std::byte> jpeg) {
  if (jpeg.empty()) return fail("JPEG: empty");
  // Its structure is of some hundred bytes: nothing beside what a frame costs.
  JpegDecoder::Impl decoder;
  JpegSize size;
  if (const char* wrong = decoder.read_size(jpeg, size); wrong != nullptr) return fail(fmt::format("JPEG: {}", wrong));
  return size;
}

JpegDecoder::JpegDecoder() : impl_(std::make_unique<Impl>()) {}
JpegDecoder::JpegDecoder(JpegDecoder&&) noexcept = default;
JpegDecoder& JpegDecoder::operator=(JpegDecoder&&) noexcept = default;
JpegDecoder::~JpegDecoder() = default;

Expected<void> JpegDecoder::decode(std::span<const std::byte> jpeg, int width, int height,
                                   std::span<std::uint8_t> grey) {
  if (jpeg.empty()) return fail("JPEG: empty");
  if (width <= 0 || height <= 0 || grey.size() < static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    return fail(fmt::format("JPEG: {} x {} pixels do not fit {} bytes", width, height, grey.size()));
  }
  if (const char* wrong = impl_->decode(jpeg, width, height, grey.data()); wrong != nullptr) {
    return fail(fmt::format("JPEG: {}", wrong));
  }
  return {};
}

}  // namespace perimap
