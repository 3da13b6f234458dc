// A calibration board to be printed: `perimap calibrate target`.
#pragma once

#include <string>

#include "core/error/expected.hpp"
#include "drivers/board/board_pattern.hpp"

namespace perimap {

struct PaperSize {
  std::string name;
  double short_mm = 0.0;
  double long_mm = 0.0;
};

// "A4", "A3", "A2", "letter".
[[nodiscard]] Expected<PaperSize> paper_named(const std::string& name);

struct PrintedTarget {
  std::string pdf;
  double page_width_mm = 0.0;
  double page_height_mm = 0.0;
  double board_x_mm = 0.0;  // the squares' upper left corner on the page
  double board_y_mm = 0.0;
};

// The board in the middle of the page, upright or across as it fits, with a line of 100 mm and the words how to print
// and measure it. Fails when it does not fit.
[[nodiscard]] Expected<PrintedTarget> print_target(const BoardPattern& pattern, const PaperSize& paper);

}  // namespace perimap
