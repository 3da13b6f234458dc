// A page to be printed at its exact size, as PDF: black rectangles and lines of text.
#pragma once

#include <string>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct PdfRectangle {
  double x_mm = 0.0;  // of its upper left corner, from the page's
  double y_mm = 0.0;
  double width_mm = 0.0;
  double height_mm = 0.0;
};

struct PdfText {
  double x_mm = 0.0;  // where its base line begins
  double y_mm = 0.0;
  double size_mm = 3.5;
  std::string text;
};

// One page of vectors; its media box is the page's size.
[[nodiscard]] Expected<std::string> pdf_page(double width_mm, double height_mm,
                                             const std::vector<PdfRectangle>& rectangles,
                                             const std::vector<PdfText>& texts);

}  // namespace perimap
