#include "daemon/pages/pdf_page.hpp"

#include <cairo-pdf.h>
#include <cairo.h>

#include <memory>

namespace perimap {
namespace {

constexpr double kPoints_per_mm = 72.0 / 25.4;

struct Unref {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};

cairo_status_t append(void* closure, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

Expected<std::string> pdf_page(double width_mm, double height_mm, const std::vector<PdfRectangle>& rectangles,
                               const std::vector<PdfText>& texts) {
  std::string pdf;
  const std::unique_ptr<cairo_surface_t, Unref> surface(
      cairo_pdf_surface_create_for_stream(append, &pdf, width_mm * kPoints_per_mm, height_mm * kPoints_per_mm));
  const std::unique_ptr<cairo_t, Unref> page(cairo_create(surface.get()));
  cairo_t* cairo = page.get();
  cairo_scale(cairo, kPoints_per_mm, kPoints_per_mm);
  cairo_set_source_rgb(cairo, 0.0, 0.0, 0.0);
  // One path, so that neighbours leave no hairlines between them.
  for (const PdfRectangle& r : rectangles) cairo_rectangle(cairo, r.x_mm, r.y_mm, r.width_mm, r.height_mm);
  cairo_fill(cairo);
  cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  for (const PdfText& text : texts) {
    cairo_set_font_size(cairo, text.size_mm);
    cairo_move_to(cairo, text.x_mm, text.y_mm);
    cairo_show_text(cairo, text.text.c_str());
  }
  cairo_show_page(cairo);
  const cairo_status_t drawn = cairo_status(cairo);
  cairo_surface_finish(surface.get());
  const cairo_status_t written = cairo_surface_status(surface.get());
  const cairo_status_t status = drawn != CAIRO_STATUS_SUCCESS ? drawn : written;
  if (status != CAIRO_STATUS_SUCCESS) return fail(std::string("PDF: ") + cairo_status_to_string(status));
  return pdf;
}

}  // namespace perimap
