// What is printed on a calibration board: black rectangles on white, in millimetres.
//
// Coordinates are those of the board's frame B as daemon/setup finds it: x to the right, y downwards, z into the board.
// Its origin is a chessboard's first inner corner, and the upper left corner of a ChArUco board's squares.
#pragma once

#include <string>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct BoardRectangle {
  double x_mm = 0.0;  // of the upper left corner
  double y_mm = 0.0;
  double width_mm = 0.0;
  double height_mm = 0.0;
};

struct BoardPattern {
  std::string name;        // "chessboard of 9x6 inner corners, squares of 8 mm"
  BoardRectangle outline;  // of all squares
  std::vector<BoardRectangle> black;
};

// columns x rows inner corners; the first square is black. Fails when there are fewer than two of either.
[[nodiscard]] Expected<BoardPattern> chessboard_pattern(int columns, int rows, double square_mm);

// columns x rows squares, the first one black; the white ones have the dictionary's markers in the order of their
// numbers, row by row. Fails when the dictionary has fewer markers than the board, or the marker fills its square.
[[nodiscard]] Expected<BoardPattern> charuco_pattern(int columns, int rows, double square_mm, double marker_mm,
                                                     int dictionary);

}  // namespace perimap
