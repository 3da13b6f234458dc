#include "daemon/setup/board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "daemon/setup/board_markers.hpp"
#include "daemon/setup/chessboard_evidence.hpp"
#include "daemon/setup/marker_dictionary.hpp"

namespace perimap {
namespace {

constexpr std::size_t kFewestPoints = 8;

// What is borrowed is only read.
cv::Mat to_cv(const GreyImage& picture) {
  return {picture.height, picture.width, CV_8UC1, const_cast<std::uint8_t*>(picture.data),
          static_cast<std::size_t>(picture.stride)};
}

// Whether neighbouring rows differ more than every other row: two fields of a moving picture.
bool is_combed(const cv::Mat& grey) {
  if (grey.rows < 8) return false;
  const int rows = grey.rows - 2;
  const double one = cv::norm(grey.rowRange(0, rows), grey.rowRange(1, rows + 1), cv::NORM_L1);
  const double two = cv::norm(grey.rowRange(0, rows), grey.rowRange(2, rows + 2), cv::NORM_L1);
  return one > 1.1 * two;
}

// Rows 0, 2, 4... at the full height again; a row y of the result is at y - 0.5 of the picture.
cv::Mat first_field(const cv::Mat& grey) {
  cv::Mat half((grey.rows + 1) / 2, grey.cols, CV_8UC1);
  for (int y = 0; y < half.rows; ++y) grey.row(2 * y).copyTo(half.row(y));
  cv::Mat whole;
  cv::resize(half, whole, {grey.cols, 2 * half.rows}, 0, 0, cv::INTER_LINEAR);
  return whole;
}

std::optional<Board> recognise_chessboard(const std::vector<cv::Mat>& pictures, const BoardWish& wish) {
  Board board;
  board.kind = BoardKind::kChessboard;
  board.columns = wish.columns;
  board.rows = wish.rows;
  if (wish.columns > 0 && wish.rows > 0) return board;
  std::map<std::pair<int, int>, int> votes;
  for (const cv::Mat& picture : pictures) {
    std::vector<cv::Point2f> corners;
    cv::Mat cells;
    const bool found = cv::findChessboardCornersSB(
        picture, {3, 3}, corners, cv::CALIB_CB_LARGER | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE, cells);
    if (!found || cells.rows < 2 || cells.cols < 2) continue;
    if (cells.rows * cells.cols <= kMostCornersByChance && !is_chessboard(picture, corners, cells.cols, cells.rows)) {
      continue;
    }
    ++votes[{std::max(cells.cols, cells.rows), std::min(cells.cols, cells.rows)}];
  }
  if (votes.empty()) return std::nullopt;
  const auto best = std::max_element(votes.begin(), votes.end(), [](const auto& a, const auto& b) {
    return std::pair(a.second, a.first) < std::pair(b.second, b.first);
  });
  board.columns = best->first.first;
  board.rows = best->first.second;
  return board;
}

bool find_circles(const cv::Mat& grey, const Board& board, std::vector<cv::Point2f>& centres) {
  const int kind = board.kind == BoardKind::kCircles ? cv::CALIB_CB_SYMMETRIC_GRID : cv::CALIB_CB_ASYMMETRIC_GRID;
  return cv::findCirclesGrid(grey, {board.columns, board.rows}, centres, kind) ||
         cv::findCirclesGrid(grey, {board.columns, board.rows}, centres, kind | cv::CALIB_CB_CLUSTERING);
}

std::optional<Board> recognise_circles(const std::vector<cv::Mat>& pictures, const BoardWish& wish) {
  constexpr std::array<std::array<int, 2>, 6> kAsymmetric{{{4, 11}, {3, 9}, {4, 9}, {5, 11}, {3, 7}, {5, 9}}};
  constexpr std::array<std::array<int, 2>, 6> kSymmetric{{{9, 6}, {7, 7}, {8, 6}, {7, 6}, {8, 7}, {10, 7}}};
  for (const BoardKind kind : {BoardKind::kAsymmetricCircles, BoardKind::kCircles}) {
    if (wish.kind && *wish.kind != kind) continue;
    std::vector<std::array<int, 2>> sizes;
    if (wish.columns > 0 && wish.rows > 0) {
      sizes = {{wish.columns, wish.rows}};
    } else if (kind == BoardKind::kAsymmetricCircles) {
      sizes.assign(kAsymmetric.begin(), kAsymmetric.end());
    } else {
      sizes.assign(kSymmetric.begin(), kSymmetric.end());
    }
    for (const auto& [columns, rows] : sizes) {
      Board board;
      board.kind = kind, board.columns = columns, board.rows = rows;
      std::vector<cv::Point2f> centres;
      for (const cv::Mat& picture : pictures) {
        if (find_circles(picture, board, centres)) return board;
      }
    }
  }
  return std::nullopt;
}

// How far corners are to be refined without meeting the next: a third of the shortest distance between neighbours.
void refine(const cv::Mat& grey, std::vector<cv::Point2f>& corners) {
  double shortest = 1e9;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) shortest = std::min(shortest, cv::norm(corners[i] - corners[j]));
  }
  const int half = static_cast<int>(std::clamp(shortest / 3.0, 2.0, 8.0));
  cv::cornerSubPix(grey, corners, {half, half}, {-1, -1}, {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 40, 0.005});
}

using Points = std::pair<std::vector<cv::Point2f>, std::vector<Vector3d>>;

// Where a point of the board is in the picture as this marker's four corners have it. `d`: from the marker's middle.
cv::Point2f by_marker(const std::vector<cv::Point2f>& corners, double share, cv::Point2d d) {
  const auto half = static_cast<float>(0.5 * share);
  const std::vector<cv::Point2f> board{{-half, -half}, {half, -half}, {half, half}, {-half, half}};
  std::vector<cv::Point2f> image;
  cv::perspectiveTransform(std::vector<cv::Point2f>{cv::Point2f(d)}, image,
                           cv::getPerspectiveTransform(board, corners));
  return image[0];
}

// The squares' corners between two markers that are seen: where both have it, then refined.
Points charuco_points(const cv::Mat& grey, const Board& board) {
  const Markers markers = markers_in(grey, board.dictionary);
  const Layout layout = board.white_first ? Layout::kCharucoWhiteFirst : Layout::kCharucoBlackFirst;
  std::map<std::pair<int, int>, std::vector<cv::Point2f>> foretold;
  double square_px = 1e9;
  for (std::size_t i = 0; i < markers.ids.size(); ++i) {
    const Cell cell = cell_of(markers.ids[i], board.columns, layout);
    const auto& corners = markers.corners[i];
    for (std::size_t k = 0; k < 4; ++k) {
      square_px = std::min(square_px, cv::norm(corners[k] - corners[(k + 1) % 4]) / board.marker_share);
    }
    for (const int dx : {0, 1}) {
      for (const int dy : {0, 1}) {
        const int x = static_cast<int>(cell.x) + dx, y = static_cast<int>(cell.y) + dy;
        if (x < 1 || y < 1 || x >= board.columns || y >= board.rows) continue;
        foretold[{x, y}].push_back(by_marker(corners, board.marker_share, {dx - 0.5, dy - 0.5}));
      }
    }
  }
  Points points;
  std::vector<cv::Point2f> before;
  for (const auto& [corner, places] : foretold) {
    if (places.size() < 2) continue;
    const cv::Point2f middle = 0.5F * (places[0] + places[1]);
    if (cv::norm(places[0] - places[1]) > 0.3 * square_px) continue;
    if (middle.x < 3 || middle.y < 3 || middle.x > static_cast<float>(grey.cols - 4) ||
        middle.y > static_cast<float>(grey.rows - 4))
      continue;
    before.push_back(middle);
    points.second.emplace_back(corner.first, corner.second, 0.0);
  }
  if (before.empty()) return {};
  // Up to the markers, whose edges would draw the corner to them.
  const double free_px = square_px * 0.5 * (1.0 - board.marker_share);
  const int half = static_cast<int>(std::clamp(0.9 * free_px * 1.4, 2.0, 8.0));
  points.first = before;
  cv::cornerSubPix(grey, points.first, {half, half}, {-1, -1},
                   {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 40, 0.005});
  Points kept;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (cv::norm(points.first[i] - before[i]) > std::max(2.0, 0.15 * square_px)) continue;
    kept.first.push_back(points.first[i]);
    kept.second.push_back(points.second[i]);
  }
  return kept;
}

Points marker_points(const cv::Mat& grey, const Board& board) {
  Points points;
  const Markers markers = markers_in(grey, board.dictionary);
  const Layout layout = board.upwards ? Layout::kGridUp : Layout::kGridDown;
  const double half = 0.5 * board.marker_share;
  for (std::size_t i = 0; i < markers.ids.size(); ++i) {
    const Cell cell = cell_of(markers.ids[i], board.columns, layout);
    if (std::abs(cell.y) >= board.rows) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      points.first.push_back(markers.corners[i][k]);
      points.second.emplace_back(cell.x + (k == 0 || k == 3 ? -half : half), cell.y + (k < 2 ? -half : half), 0.0);
    }
  }
  if (!points.first.empty()) refine(grey, points.first);
  return points;
}

// Grey level in the middle of the square to the right of and below a corner.
double level_of_square(const cv::Mat& grey, const std::vector<cv::Point2f>& corners, int columns, int x, int y) {
  const auto at = [&](int i, int j) { return corners[static_cast<std::size_t>(j * columns + i)]; };
  const cv::Point2f middle = 0.25F * (at(x, y) + at(x + 1, y) + at(x, y + 1) + at(x + 1, y + 1));
  const cv::Rect around(static_cast<int>(middle.x) - 1, static_cast<int>(middle.y) - 1, 3, 3);
  const cv::Rect seen = around & cv::Rect(0, 0, grey.cols, grey.rows);
  return seen.empty() ? 0.0 : cv::mean(grey(seen))[0];
}

// A chessboard turned by half a turn looks alike but for its colours, where it has an odd number of corners one way and
// an even one the other: then the first square is the black one. Other boards have no first corner; theirs is as found.
void put_black_first(const cv::Mat& grey, const Board& board, std::vector<cv::Point2f>& corners) {
  if (board.columns % 2 == board.rows % 2) return;
  double even = 0.0;
  double odd = 0.0;
  for (int y = 0; y + 1 < board.rows; ++y) {
    for (int x = 0; x + 1 < board.columns; ++x) {
      ((x + y) % 2 == 0 ? even : odd) += level_of_square(grey, corners, board.columns, x, y);
    }
  }
  // As many of each kind, or one more of those that the first is of: an average square's level decides.
  const int squares = (board.columns - 1) * (board.rows - 1);
  const int odd_squares = squares / 2;
  const double of_even = even / (squares - odd_squares);
  const double of_odd = odd / std::max(1, odd_squares);
  if (of_even > of_odd) std::reverse(corners.begin(), corners.end());
}

Points grid_points(const cv::Mat& grey, const Board& board) {
  Points points;
  const cv::Size size(board.columns, board.rows);
  bool found = false;
  if (board.kind == BoardKind::kChessboard) {
    found = cv::findChessboardCornersSB(grey, size, points.first,
                                        cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY);
    if (!found) {
      found = cv::findChessboardCorners(
          grey, size, points.first,
          cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK);
      if (found) refine(grey, points.first);
    }
    found = found && (board.columns * board.rows > kMostCornersByChance ||
                      is_chessboard(grey, points.first, board.columns, board.rows));
    if (found) put_black_first(grey, board, points.first);
  } else {
    found = find_circles(grey, board, points.first);
  }
  if (!found) return {};
  for (int y = 0; y < board.rows; ++y) {
    for (int x = 0; x < board.columns; ++x) {
      if (board.kind == BoardKind::kAsymmetricCircles) {
        points.second.emplace_back(0.5 * (2 * x + y % 2), 0.5 * y, 0.0);
      } else {
        points.second.emplace_back(x, y, 0.0);
      }
    }
  }
  return points;
}

Points points_of(const cv::Mat& grey, const Board& board) {
  return board.kind == BoardKind::kCharuco   ? charuco_points(grey, board)
         : board.kind == BoardKind::kMarkers ? marker_points(grey, board)
                                             : grid_points(grey, board);
}

std::optional<Board> recognise(const std::vector<cv::Mat>& pictures, const BoardWish& wish) {
  const auto wants = [&](std::initializer_list<BoardKind> kinds) {
    return !wish.kind || std::find(kinds.begin(), kinds.end(), *wish.kind) != kinds.end();
  };
  std::optional<Board> board;
  if (wants({BoardKind::kCharuco, BoardKind::kMarkers})) board = recognise_markers(pictures, wish);
  if (!board && wants({BoardKind::kChessboard})) board = recognise_chessboard(pictures, wish);
  if (!board && wants({BoardKind::kCircles, BoardKind::kAsymmetricCircles})) board = recognise_circles(pictures, wish);
  return board;
}

// Another board than the one that the wish names, where these pictures show that and none shows the one that is named.
std::optional<Board> another_board(const std::vector<cv::Mat>& pictures, const BoardWish& wish,
                                   const std::optional<Board>& board) {
  const bool is_named = wish.kind || wish.columns > 0 || !wish.dictionary.empty();
  if (!is_named) return std::nullopt;
  // A chessboard whose size is named is taken for that unseen.
  if (board && (board->kind != BoardKind::kChessboard || wish.columns == 0)) return std::nullopt;
  if (board && std::any_of(pictures.begin(), pictures.end(), [&](const cv::Mat& picture) {
        return points_of(picture, *board).first.size() >= kFewestPoints;
      })) {
    return std::nullopt;
  }
  const auto other = recognise(pictures, {});
  const bool is_same = board && other && other->kind == board->kind &&
                       std::minmax(other->columns, other->rows) == std::minmax(board->columns, board->rows);
  return is_same ? std::nullopt : other;
}

std::string size_of(const Board& board) { return fmt::format("{}x{}", board.columns, board.rows); }

}  // namespace

std::string name_of(const Board& board) {
  switch (board.kind) {
    case BoardKind::kChessboard:
      return fmt::format("chessboard of {} inner corners", size_of(board));
    case BoardKind::kCharuco:
      return fmt::format("ChArUco board of {} squares, markers {} of {:.2f} squares", size_of(board),
                         dictionary_name(board.dictionary), board.marker_share);
    case BoardKind::kMarkers:
      return fmt::format("grid of {} markers {}", size_of(board), dictionary_name(board.dictionary));
    case BoardKind::kCircles:
      return fmt::format("grid of {} circles", size_of(board));
    case BoardKind::kAsymmetricCircles:
      return fmt::format("asymmetric grid of {} circles", size_of(board));
  }
  return "";
}

Expected<Board> recognise_board(const std::vector<GreyImage>& pictures, const BoardWish& wish) {
  // A few tell it, from all over the series.
  constexpr std::size_t kMostLooked = 8;
  if (!wish.dictionary.empty()) {
    if (const auto known = dictionary_named(wish.dictionary); !known) return tl::unexpected(known.error());
  }
  std::vector<cv::Mat> looked;
  const std::size_t count = std::min(kMostLooked, pictures.size());
  for (std::size_t k = 0; k < count; ++k) {
    const cv::Mat grey = to_cv(pictures[k * pictures.size() / count]);
    looked.push_back(is_combed(grey) ? first_field(grey) : grey);
  }
  std::optional<Board> board = recognise(looked, wish);
  if (const auto other = another_board(looked, wish, board)) {
    return fail(fmt::format(
        "the pictures show a {}, and not the board that --board, --size and --dictionary name: mend or leave out those",
        name_of(*other)));
  }
  if (!board) {
    return fail(
        fmt::format("no board is seen in the {} of {} pictures that were looked at: is it whole in the picture, sharp "
                    "and evenly lit? "
                    "If it is, say what it is with --board, --size and, for markers, --dictionary",
                    looked.size(), pictures.size()));
  }
  board->square_mm = wish.square_mm > 0.0 ? wish.square_mm : 1.0;
  return *board;
}

std::optional<BoardView> find_board(const GreyImage& picture, const Board& board) {
  const cv::Mat whole = to_cv(picture);
  const bool combed = is_combed(whole);
  const cv::Mat grey = combed ? first_field(whole) : whole;
  const auto [px, squares] = points_of(grey, board);
  if (px.size() < kFewestPoints) return std::nullopt;
  BoardView view;
  for (std::size_t i = 0; i < px.size(); ++i) {
    view.px.emplace_back(px[i].x, px[i].y - (combed ? 0.5 : 0.0));
    view.board_mm.emplace_back(board.square_mm * squares[i]);
  }
  return view;
}

}  // namespace perimap
