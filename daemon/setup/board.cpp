#include "daemon/setup/board.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <numeric>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace perimap {
namespace {

constexpr std::size_t kFewestPoints = 8;
constexpr int kLargestBoard = 60;  // squares a side that are tried

struct DictionaryName {
  const char* name;
  cv::aruco::PREDEFINED_DICTIONARY_NAME id;
};
constexpr std::array<DictionaryName, 21> kDictionaries{{
    {"4X4_50", cv::aruco::DICT_4X4_50},
    {"4X4_100", cv::aruco::DICT_4X4_100},
    {"4X4_250", cv::aruco::DICT_4X4_250},
    {"4X4_1000", cv::aruco::DICT_4X4_1000},
    {"5X5_50", cv::aruco::DICT_5X5_50},
    {"5X5_100", cv::aruco::DICT_5X5_100},
    {"5X5_250", cv::aruco::DICT_5X5_250},
    {"5X5_1000", cv::aruco::DICT_5X5_1000},
    {"6X6_50", cv::aruco::DICT_6X6_50},
    {"6X6_100", cv::aruco::DICT_6X6_100},
    {"6X6_250", cv::aruco::DICT_6X6_250},
    {"6X6_1000", cv::aruco::DICT_6X6_1000},
    {"7X7_50", cv::aruco::DICT_7X7_50},
    {"7X7_100", cv::aruco::DICT_7X7_100},
    {"7X7_250", cv::aruco::DICT_7X7_250},
    {"7X7_1000", cv::aruco::DICT_7X7_1000},
    {"ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
    {"APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11},
}};

const char* dictionary_name(int id) {
  for (const DictionaryName& dictionary : kDictionaries) {
    if (dictionary.id == id) return dictionary.name;
  }
  return "?";
}

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

struct Markers {
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;
};

Markers markers_in(const cv::Mat& grey, int dictionary) {
  Markers markers;
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
  cv::aruco::detectMarkers(grey, cv::aruco::getPredefinedDictionary(dictionary), markers.corners, markers.ids,
                           parameters);
  return markers;
}

cv::Point2f middle_of(const std::vector<cv::Point2f>& corners) {
  return 0.25F * (corners[0] + corners[1] + corners[2] + corners[3]);
}

// Column and row of a marker's square in a layout of so many columns; x counted from the left, y downwards.
struct Cell {
  double x;
  double y;
};
enum class Layout { kCharucoBlackFirst, kCharucoWhiteFirst, kGridDown, kGridUp };

Cell cell_of(int id, int columns, Layout layout) {
  if (layout == Layout::kGridDown || layout == Layout::kGridUp) {
    const int y = id / columns;
    return {static_cast<double>(id % columns), layout == Layout::kGridDown ? y : -static_cast<double>(y)};
  }
  // Markers are in every other square; a row begins with one or has its first in the second square.
  const int first = layout == Layout::kCharucoBlackFirst ? 1 : 0;  // square of the first marker of row 0
  const int in_row_0 = (columns - first + 1) / 2;
  const int in_row_1 = (columns - (1 - first) + 1) / 2;
  const int pair = id / (in_row_0 + in_row_1);
  const int rest = id % (in_row_0 + in_row_1);
  const bool odd = rest >= in_row_0;
  const int y = 2 * pair + (odd ? 1 : 0);
  const int begin = odd ? 1 - first : first;
  const int k = odd ? rest - in_row_0 : rest;
  return {static_cast<double>(begin + 2 * k), static_cast<double>(y)};
}

// The markers nearest to the middle of all: a patch that distortion hardly bends.
Markers patch_of(const Markers& markers) {
  constexpr std::size_t kPatch = 20;
  cv::Point2f middle(0.0F, 0.0F);
  for (const auto& corners : markers.corners) middle += middle_of(corners) / static_cast<float>(markers.corners.size());
  std::vector<std::size_t> order(markers.ids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return cv::norm(middle_of(markers.corners[a]) - middle) < cv::norm(middle_of(markers.corners[b]) - middle);
  });
  Markers patch;
  for (std::size_t k = 0; k < std::min(kPatch, order.size()); ++k) {
    patch.ids.push_back(markers.ids[order[k]]);
    patch.corners.push_back(markers.corners[order[k]]);
  }
  return patch;
}

// RMS distance, in markers' sides, of the markers' middles from a plane image of the layout, of those that fit it;
// infinite when fewer than three quarters do, or it is a mirror image.
double misfit_of(const Markers& markers, int columns, Layout layout) {
  std::vector<cv::Point2f> board;
  std::vector<cv::Point2f> image;
  double side = 0.0;
  for (std::size_t i = 0; i < markers.ids.size(); ++i) {
    const Cell cell = cell_of(markers.ids[i], columns, layout);
    board.emplace_back(static_cast<float>(cell.x), static_cast<float>(cell.y));
    image.push_back(middle_of(markers.corners[i]));
    side += cv::norm(markers.corners[i][1] - markers.corners[i][0]) / static_cast<double>(markers.ids.size());
  }
  constexpr double kNear = 0.25;  // of a side: a marker in a wrong square is a side and more away
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const cv::Mat H = cv::findHomography(board, image, cv::RANSAC, kNear * side);
  if (H.empty() || cv::determinant(H(cv::Rect(0, 0, 2, 2))) <= 0.0) return kNone;
  std::vector<cv::Point2f> mapped;
  cv::perspectiveTransform(board, mapped, H);
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < mapped.size(); ++i) {
    const double d = cv::norm(mapped[i] - image[i]) / side;
    if (d <= kNear) squares += d * d, count += 1.0;
  }
  if (count < 0.75 * static_cast<double>(mapped.size())) return kNone;
  return std::sqrt(squares / count);
}

// A marker's side in squares: how far apart neighbours' middles are, in the marker's own axes.
double marker_share_of(const Markers& markers, int columns, Layout layout) {
  std::vector<double> shares;
  for (std::size_t i = 0; i < markers.ids.size(); ++i) {
    const Cell a = cell_of(markers.ids[i], columns, layout);
    for (std::size_t j = 0; j < markers.ids.size(); ++j) {
      const Cell b = cell_of(markers.ids[j], columns, layout);
      const double squares = std::hypot(b.x - a.x, b.y - a.y);
      if (j == i || squares > 2.01) continue;
      const auto& corners = markers.corners[i];
      const cv::Matx22d axes(corners[1].x - corners[0].x, corners[3].x - corners[0].x, corners[1].y - corners[0].y,
                             corners[3].y - corners[0].y);
      const cv::Point2f d = middle_of(markers.corners[j]) - middle_of(corners);
      const cv::Vec2d sides = axes.inv() * cv::Vec2d(d.x, d.y);
      shares.push_back(squares / cv::norm(sides));
    }
  }
  if (shares.empty()) return 0.0;
  std::nth_element(shares.begin(), shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2), shares.end());
  return shares[shares.size() / 2];
}

// The layout that the markers of one picture fit best; none with fewer than six, or when none fits clearly.
std::optional<Board> layout_of(const Markers& markers, int dictionary, const BoardWish& wish) {
  if (markers.ids.size() < 6) return std::nullopt;
  double best = std::numeric_limits<double>::infinity();
  int columns = 0;
  Layout layout = Layout::kCharucoBlackFirst;
  const Markers patch = patch_of(markers);
  const int largest = 1 + *std::max_element(markers.ids.begin(), markers.ids.end());
  for (int width = 2; width <= kLargestBoard; ++width) {
    for (const Layout one :
         {Layout::kCharucoBlackFirst, Layout::kCharucoWhiteFirst, Layout::kGridDown, Layout::kGridUp}) {
      const bool charuco = one == Layout::kCharucoBlackFirst || one == Layout::kCharucoWhiteFirst;
      if (wish.kind == BoardKind::kCharuco && !charuco) continue;
      if (wish.kind == BoardKind::kMarkers && charuco) continue;
      if (wish.columns > 0 && wish.columns != width) continue;
      if (!charuco && width > largest) continue;
      const double misfit = misfit_of(patch, width, one);
      // A narrower board is to be clearly worse to lose: distortion bends all alike.
      if (misfit < 0.98 * best) best = misfit, columns = width, layout = one;
    }
  }
  if (!std::isfinite(best)) return std::nullopt;
  Board board;
  const bool charuco = layout == Layout::kCharucoBlackFirst || layout == Layout::kCharucoWhiteFirst;
  board.kind = charuco ? BoardKind::kCharuco : BoardKind::kMarkers;
  board.columns = columns;
  board.dictionary = dictionary;
  board.upwards = layout == Layout::kGridUp;
  board.marker_share = marker_share_of(markers, columns, layout);
  board.rows = static_cast<int>(std::abs(cell_of(largest - 1, columns, layout).y)) + 1;
  board.white_first = layout == Layout::kCharucoWhiteFirst;
  if (charuco && board.marker_share >= 0.98) return std::nullopt;
  return board;
}

// The dictionary, of those of each family with all its markers, that finds most in a few of the pictures.
std::optional<std::pair<int, std::vector<Markers>>> most_markers(const std::vector<cv::Mat>& pictures,
                                                                 const BoardWish& wish) {
  std::optional<std::pair<int, std::vector<Markers>>> best;
  std::size_t most = 0;
  for (const DictionaryName& dictionary : kDictionaries) {
    const std::string name = dictionary.name;
    if (!wish.dictionary.empty() ? name != wish.dictionary
                                 : name.ends_with("_50") || name.ends_with("_100") || name.ends_with("_250")) {
      continue;
    }
    std::vector<Markers> found;
    std::size_t count = 0;
    for (const cv::Mat& picture : pictures) {
      found.push_back(markers_in(picture, dictionary.id));
      count += found.back().ids.size();
    }
    if (count > most) {
      most = count;
      best = {dictionary.id, std::move(found)};
    }
  }
  if (most < 6) return std::nullopt;
  return best;
}

// The smallest dictionary of the family that has all these markers: the fewer it has the more damage they survive.
int smallest_dictionary(int dictionary, int largest_id) {
  const std::string family = std::string(dictionary_name(dictionary));
  if (!family.ends_with("_1000")) return dictionary;
  const std::string prefix = family.substr(0, family.find('_') + 1);
  for (const int size : {50, 100, 250}) {
    if (largest_id >= size) continue;
    for (const DictionaryName& one : kDictionaries) {
      if (one.name == prefix + std::to_string(size)) return one.id;
    }
  }
  return dictionary;
}

std::optional<Board> recognise_markers(const std::vector<cv::Mat>& pictures, const BoardWish& wish) {
  const auto found = most_markers(pictures, wish);
  if (!found) return std::nullopt;
  // The pictures vote; the one with most markers decides among equals, and rows are the most that any of them shows.
  std::map<std::pair<int, int>, int> votes;
  std::vector<std::pair<std::size_t, Board>> boards;
  for (const Markers& markers : found->second) {
    const auto board = layout_of(markers, found->first, wish);
    if (!board) continue;
    ++votes[{static_cast<int>(board->kind), board->columns}];
    boards.emplace_back(markers.ids.size(), *board);
  }
  if (boards.empty()) return std::nullopt;
  const auto votes_of = [&](const Board& b) { return votes[{static_cast<int>(b.kind), b.columns}]; };
  std::sort(boards.begin(), boards.end(), [&](const auto& a, const auto& b) {
    return std::pair(votes_of(a.second), a.first) > std::pair(votes_of(b.second), b.first);
  });
  Board board = boards.front().second;
  int largest_id = 0;
  for (const auto& [count, other] : boards) {
    if (other.kind == board.kind && other.columns == board.columns) board.rows = std::max(board.rows, other.rows);
  }
  for (const Markers& markers : found->second) {
    for (const int id : markers.ids) largest_id = std::max(largest_id, id);
  }
  if (wish.rows > 0) board.rows = wish.rows;
  if (wish.dictionary.empty()) board.dictionary = smallest_dictionary(board.dictionary, largest_id);
  if (wish.marker_mm > 0.0 && wish.square_mm > 0.0) board.marker_share = wish.marker_mm / wish.square_mm;
  return board;
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
  if (!wish.dictionary.empty() && std::none_of(kDictionaries.begin(), kDictionaries.end(),
                                               [&](const DictionaryName& d) { return d.name == wish.dictionary; })) {
    std::string names;
    for (const DictionaryName& d : kDictionaries) names += fmt::format("{}{}", names.empty() ? "" : ", ", d.name);
    return fail(fmt::format("--dictionary: '{}' is not one of {}", wish.dictionary, names));
  }
  std::vector<cv::Mat> looked;
  const std::size_t count = std::min(kMostLooked, pictures.size());
  for (std::size_t k = 0; k < count; ++k) {
    const cv::Mat grey = to_cv(pictures[k * pictures.size() / count]);
    looked.push_back(is_combed(grey) ? first_field(grey) : grey);
  }
  const auto wants = [&](std::initializer_list<BoardKind> kinds) {
    return !wish.kind || std::find(kinds.begin(), kinds.end(), *wish.kind) != kinds.end();
  };
  std::optional<Board> board;
  if (wants({BoardKind::kCharuco, BoardKind::kMarkers})) board = recognise_markers(looked, wish);
  if (!board && wants({BoardKind::kChessboard})) board = recognise_chessboard(looked, wish);
  if (!board && wants({BoardKind::kCircles, BoardKind::kAsymmetricCircles})) board = recognise_circles(looked, wish);
  if (!board) {
    return fail(
        fmt::format("no board is seen in {} of the {} pictures that were looked at: is it whole in the picture, sharp "
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
  const auto [px, squares] = board.kind == BoardKind::kCharuco   ? charuco_points(grey, board)
                             : board.kind == BoardKind::kMarkers ? marker_points(grey, board)
                                                                 : grid_points(grey, board);
  if (px.size() < kFewestPoints) return std::nullopt;
  BoardView view;
  for (std::size_t i = 0; i < px.size(); ++i) {
    view.px.emplace_back(px[i].x, px[i].y - (combed ? 0.5 : 0.0));
    view.board_mm.push_back(board.square_mm * squares[i]);
  }
  return view;
}

}  // namespace perimap
