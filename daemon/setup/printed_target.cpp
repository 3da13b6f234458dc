#include "daemon/setup/printed_target.hpp"

#include <fmt/format.h>

#include <array>
#include <vector>

#include "daemon/pages/pdf_page.hpp"

namespace perimap {
namespace {

constexpr double kMargin_mm = 10.0;  // what printers leave white
constexpr double kWords_mm = 22.0;   // below the board
constexpr double kRuler_mm = 100.0;

}  // namespace

Expected<PaperSize> paper_named(const std::string& name) {
  static const std::array<PaperSize, 4> papers{
      {{"A4", 210.0, 297.0}, {"A3", 297.0, 420.0}, {"A2", 420.0, 594.0}, {"letter", 215.9, 279.4}}};
  std::string names;
  for (const PaperSize& paper : papers) {
    if (paper.name == name) return paper;
    names += (names.empty() ? "" : ", ") + paper.name;
  }
  return fail(fmt::format("--page: expected one of {}, got {}", names, name));
}

Expected<PrintedTarget> print_target(const BoardPattern& pattern, const PaperSize& paper) {
  const double width = pattern.outline.width_mm;
  const double height = pattern.outline.height_mm;
  const bool across = width > height;
  PrintedTarget target;
  target.page_width_mm = across ? paper.long_mm : paper.short_mm;
  target.page_height_mm = across ? paper.short_mm : paper.long_mm;
  const double free_width = target.page_width_mm - 2.0 * kMargin_mm;
  const double free_height = target.page_height_mm - 2.0 * kMargin_mm - kWords_mm;
  if (width > free_width || height > free_height) {
    return fail(
        fmt::format("the board is {:g} x {:g} mm, and {} takes {:g} x {:g} mm of it: take smaller or fewer "
                    "squares, or a larger page with --page",
                    width, height, paper.name, free_width, free_height));
  }
  target.board_x_mm = 0.5 * (target.page_width_mm - width);
  target.board_y_mm = kMargin_mm + 0.5 * (free_height - height);
  std::vector<PdfRectangle> rectangles;
  for (const BoardRectangle& r : pattern.black) {
    rectangles.push_back({target.board_x_mm + r.x_mm - pattern.outline.x_mm,
                          target.board_y_mm + r.y_mm - pattern.outline.y_mm, r.width_mm, r.height_mm});
  }
  const double words_y = target.page_height_mm - kMargin_mm - kWords_mm + 8.0;
  constexpr double kLine_mm = 0.25;
  rectangles.push_back({kMargin_mm, words_y, kRuler_mm, kLine_mm});
  rectangles.push_back({kMargin_mm, words_y - 2.0, kLine_mm, 4.0});
  rectangles.push_back({kMargin_mm + kRuler_mm - kLine_mm, words_y - 2.0, kLine_mm, 4.0});
  const std::vector<PdfText> texts{
      {kMargin_mm + kRuler_mm + 3.0, words_y + 1.0, 3.2, "100 mm: measure it after printing"},
      {kMargin_mm, words_y + 7.0, 3.2, "perimap: " + pattern.name},
      {kMargin_mm, words_y + 12.0, 3.2,
       fmt::format("Page {} ({:g} x {:g} mm). Print at 100 %, not fitted to the page, and glue it on something flat.",
                   paper.name, target.page_width_mm, target.page_height_mm)}};
  auto pdf = pdf_page(target.page_width_mm, target.page_height_mm, rectangles, texts);
  if (!pdf) return tl::unexpected(pdf.error());
  target.pdf = *std::move(pdf);
  return target;
}

}  // namespace perimap
