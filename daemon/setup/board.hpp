// Calibration boards: which one stands in pictures, and where its points are in each.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

enum class BoardKind {
  kChessboard,         // columns x rows: its inner corners
  kCharuco,            // columns x rows: its squares
  kMarkers,            // ArUco or AprilTag markers in a grid; columns x rows of markers
  kCircles,            // columns x rows of circles
  kAsymmetricCircles,  // columns x rows as OpenCV counts them: circles of a row, and rows
};

struct Board {
  BoardKind kind = BoardKind::kChessboard;
  int columns = 0;
  int rows = 0;
  double square_mm = 1.0;     // between neighbouring points; 1: not known, and poses are then in squares
  double marker_share = 0.0;  // a marker's side in squares; 0 without markers
  int dictionary = -1;        // of the markers, as OpenCV counts them
  bool upwards = false;       // kMarkers: the numbers run from below upwards
  bool white_first = false;  // kCharuco: the first square has a marker, as boards of an even number of rows had it once
};

// "ChArUco 19x26 squares, markers of 4X4_250"
[[nodiscard]] std::string name_of(const Board& board);

// What is told of a board; what is not told is looked for in the pictures.
struct BoardWish {
  std::optional<BoardKind> kind;
  int columns = 0;  // 0: not told
  int rows = 0;
  double square_mm = 0.0;
  double marker_mm = 0.0;
  std::string dictionary;  // "4X4_250", "APRILTAG_36h11"; empty: not told
};

struct BoardView {
  std::string name;                // the picture's
  std::vector<Vector3d> board_mm;  // points in the board's frame B (z = 0)
  std::vector<Vector2d> px;        // where they are in the picture
};

// The board that most of the pictures show. Fails when none shows one, and says what was looked for.
[[nodiscard]] Expected<Board> recognise_board(const std::vector<GreyImage>& pictures, const BoardWish& wish);

// At least eight of its points, refined between pixels; none when it is not seen. Of an interlaced picture that moved
// between its two fields the first is taken.
[[nodiscard]] std::optional<BoardView> find_board(const GreyImage& picture, const Board& board);

}  // namespace perimap
