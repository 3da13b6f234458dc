#include "drivers/image/jpeg_decoder.hpp"

#include <fmt/format.h>

#include <csetjmp>
#include <cstdio>
// After cstdio, which it needs and does not include.
#include <jerror.h>
#include <jpeglib.h>

#include <array>
#include <new>

#include "core/sensors/colour_image.hpp"

namespace perimap {

// NOLINTBEGIN(cert-err52-cpp): longjmp is the library's way out of an error; only C frames and trivial locals are left
struct JpegDecoder::Impl {
  jpeg_error_mgr errors{};
  jpeg_decompress_struct jpeg{};
  std::jmp_buf on_error{};
  std::array<char, JMSG_LENGTH_MAX> message{};
  bool one_scan = false;  // as the header has it, once it is read

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
      if (level >= 0 || is_harmless(common)) return;
      common->err->error_exit(common);
    };
    if (setjmp(on_error) != 0) throw std::bad_alloc();
    jpeg_create_decompress(&jpeg);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() { jpeg_destroy_decompress(&jpeg); }

  // What leaves every pixel as it was sent. Data that are missing, or do not fit their Huffman codes, are told by
  // warnings of their own.
  static bool is_harmless(j_common_ptr common) {
    const int code = common->err->msg_code;
    if (code == JWRN_EXTRANEOUS_DATA) {
      // Bytes to spare before the end, or before a restart, where webcams pad. The second number is the marker.
      // NOLINTNEXTLINE(cppcoreguidelines-pro-type-union-access): the library's own type
      const int marker = common->err->msg_parm.i[1];
      return marker == JPEG_EOI || (marker >= JPEG_RST0 && marker <= JPEG_RST0 + 7);
    }
    // No end marker. Of one scan all the data may be there; of several none may be missing.
    return code == JWRN_JPEG_EOF && of(common).one_scan;
  }

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
    one_scan = false;
    jpeg_mem_src(&jpeg, data, bytes.size());
    (void)jpeg_read_header(&jpeg, TRUE);
    one_scan = jpeg_has_multiple_scans(&jpeg) == FALSE;
  }

  // Null when it is done; otherwise what is wrong. Its locals are trivial, since a longjmp runs no destructors.
  const char* decode(std::span<const std::byte> bytes, int width, int height, bool colour, std::uint8_t* out) {
    if (setjmp(on_error) != 0) {
      jpeg_abort_decompress(&jpeg);
      return message.data();
    }
    read_header(bytes);
    if (const char* const wrong = unusable(width, height, colour); wrong != nullptr) {
      jpeg_abort_decompress(&jpeg);
      return wrong;
    }
    if (colour) {
      jpeg.out_color_space = JCS_EXT_BGR;
      jpeg.scale_denom = kColourReduction * jpeg.scale_num;
    } else {
      jpeg.out_color_space = JCS_GRAYSCALE;
    }
    (void)jpeg_start_decompress(&jpeg);
    const std::size_t row_bytes = std::size_t{jpeg.output_width} * static_cast<unsigned>(jpeg.output_components);
    while (jpeg.output_scanline < jpeg.output_height) {
      JSAMPROW row = out + jpeg.output_scanline * row_bytes;
      (void)jpeg_read_scanlines(&jpeg, &row, 1);
    }
    (void)jpeg_finish_decompress(&jpeg);
    return nullptr;
  }

  // Null when the picture whose header has been read can be decoded; otherwise what is wrong with it.
  [[nodiscard]] const char* unusable(int width, int height, bool colour) const {
    const bool luma = jpeg.jpeg_color_space == JCS_YCbCr || jpeg.jpeg_color_space == JCS_GRAYSCALE;
    if (!luma) return "no luma";
    if (colour && jpeg.jpeg_color_space == JCS_GRAYSCALE) return "no colour";
    if (jpeg.image_width != static_cast<JDIMENSION>(width) || jpeg.image_height != static_cast<JDIMENSION>(height)) {
      return "another size than announced";
    }
    // No camera sends it, and its scans can make a small file take minutes.
    return jpeg.progressive_mode != FALSE ? "progressive" : nullptr;
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
  return decode(jpeg, width, height, {width, height, 1}, grey);
}

Expected<void> JpegDecoder::decode_reduced_colour(std::span<const std::byte> jpeg, int width, int height,
                                                  std::span<std::uint8_t> bgr) {
  return decode(jpeg, width, height, {reduced_side(width), reduced_side(height), 3}, bgr);
}

Expected<void> JpegDecoder::decode(std::span<const std::byte> jpeg, int width, int height, const Wanted& wanted,
                                   std::span<std::uint8_t> out) {
  if (jpeg.empty()) return fail("JPEG: empty");
  if (width <= 0 || height <= 0 ||
      out.size() < static_cast<std::size_t>(wanted.width) * static_cast<std::size_t>(wanted.height) *
                       static_cast<std::size_t>(wanted.samples)) {
    return fail(fmt::format("JPEG: {} x {} pixels do not fit {} bytes", wanted.width, wanted.height, out.size()));
  }
  if (const char* wrong = impl_->decode(jpeg, width, height, wanted.samples > 1, out.data()); wrong != nullptr) {
    return fail(fmt::format("JPEG: {}", wrong));
  }
  return {};
}

}  // namespace perimap
