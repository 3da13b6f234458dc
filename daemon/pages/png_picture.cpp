#include "daemon/pages/png_picture.hpp"

#include <cairo.h>
#include <librsvg/rsvg.h>

#include <cmath>
#include <memory>

namespace perimap {
namespace {

struct Unref {
  void operator()(RsvgHandle* handle) const noexcept { g_object_unref(handle); }
  void operator()(cairo_surface_t* surface) const noexcept { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const noexcept { cairo_destroy(context); }
};

cairo_status_t append(void* out, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(out)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

std::string message_of(GError* error) {
  std::string message = error != nullptr ? error->message : "unknown error";
  g_clear_error(&error);
  return message;
}

}  // namespace

Expected<std::string> png_of_svg(const std::string& svg, double scale) {
  GError* error = nullptr;
  const std::unique_ptr<RsvgHandle, Unref> handle(
      rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), &error));
  if (!handle) return fail("SVG: " + message_of(error));
  double width = 0.0;
  double height = 0.0;
  if (rsvg_handle_get_intrinsic_size_in_pixels(handle.get(), &width, &height) == 0) return fail("SVG: it has no size");
  const RsvgRectangle viewport{0.0, 0.0, scale * width, scale * height};
  const std::unique_ptr<cairo_surface_t, Unref> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::lround(viewport.width)),
                                 static_cast<int>(std::lround(viewport.height))));
  const std::unique_ptr<cairo_t, Unref> context(cairo_create(surface.get()));
  if (rsvg_handle_render_document(handle.get(), context.get(), &viewport, &error) == 0)
    return fail("SVG: " + message_of(error));
  std::string png;
  const cairo_status_t status = cairo_surface_write_to_png_stream(surface.get(), append, &png);
  if (status != CAIRO_STATUS_SUCCESS) return fail(std::string("PNG: ") + cairo_status_to_string(status));
  return png;
}

}  // namespace perimap
