#include "drivers/board/board_pattern.hpp"

#include <fmt/format.h>

#include <opencv2/aruco.hpp>

namespace perimap {
namespace {

constexpr int kMostSquares = 100;  // a side

Expected<void> check_size(int columns, int rows, double square_mm) {
  if (columns < 2 || rows < 2 || columns > kMostSquares || rows > kMostSquares) {
    return fail(fmt::format("board: expected 2 to {} columns and rows, got {}x{}", kMostSquares, columns, rows));
  }
  if (!(square_mm >= 0.1 && square_mm <= 1000.0)) {
    return fail(fmt::format("board: expected squares of 0.1 to 1000 mm, got {:g} mm", square_mm));
  }
  return {};
}

bool is_black(int x, int y) { return (x + y) % 2 == 0; }

void add_squares(BoardPattern& pattern, int columns, int rows, double square_mm) {
  const BoardRectangle& all = pattern.outline;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      if (!is_black(x, y)) continue;
      pattern.black.push_back({all.x_mm + x * square_mm, all.y_mm + y * square_mm, square_mm, square_mm});
    }
  }
}

// The black bits of a marker with its border of one bit, one rectangle for those next to each other in a row.
void add_marker(BoardPattern& pattern, const cv::Mat& bits, double x_mm, double y_mm, double bit_mm) {
  for (int row = 0; row < bits.rows; ++row) {
    for (int begin = 0; begin < bits.cols;) {
      int end = begin;
      while (end < bits.cols && bits.at<std::uint8_t>(row, end) == 0) ++end;
      if (end > begin) {
        pattern.black.push_back({x_mm + begin * bit_mm, y_mm + row * bit_mm, (end - begin) * bit_mm, bit_mm});
      }
      begin = end + 1;
    }
  }
}

}  // namespace

Expected<BoardPattern> chessboard_pattern(int columns, int rows, double square_mm) {
  if (const auto good = check_size(columns, rows, square_mm); !good) return tl::unexpected(good.error());
  BoardPattern pattern;
  pattern.name = fmt::format("chessboard of {}x{} inner corners, squares of {:g} mm", columns, rows, square_mm);
  pattern.outline = {-square_mm, -square_mm, (columns + 1) * square_mm, (rows + 1) * square_mm};
  add_squares(pattern, columns + 1, rows + 1, square_mm);
  return pattern;
}

Expected<BoardPattern> charuco_pattern(int columns, int rows, double square_mm, double marker_mm, int dictionary) {
  if (const auto good = check_size(columns, rows, square_mm); !good) return tl::unexpected(good.error());
  if (!(marker_mm > 0.2 * square_mm && marker_mm < 0.95 * square_mm)) {
    return fail(
        fmt::format("board: expected markers of 20 to 95 % of a square of {:g} mm, got {:g} mm", square_mm, marker_mm));
  }
  const cv::Ptr<cv::aruco::Dictionary> markers = cv::aruco::getPredefinedDictionary(dictionary);
  const int needed = columns * rows / 2;
  if (markers->bytesList.rows < needed) {
    return fail(fmt::format("board: {}x{} squares have {} markers, and the dictionary has {} only", columns, rows,
                            needed, markers->bytesList.rows));
  }
  BoardPattern pattern;
  pattern.name =
      fmt::format("ChArUco board of {}x{} squares of {:g} mm, markers of {:g} mm", columns, rows, square_mm, marker_mm);
  pattern.outline = {0.0, 0.0, columns * square_mm, rows * square_mm};
  add_squares(pattern, columns, rows, square_mm);
  const int bits_a_side = markers->markerSize + 2;
  const double free_mm = 0.5 * (square_mm - marker_mm);
  int id = 0;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      if (is_black(x, y)) continue;
      cv::Mat bits;
      markers->drawMarker(id++, bits_a_side, bits, 1);
      add_marker(pattern, bits, x * square_mm + free_mm, y * square_mm + free_mm, marker_mm / bits_a_side);
    }
  }
  return pattern;
}

}  // namespace perimap
