#include "daemon/setup/board_markers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <numeric>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <utility>

#include "daemon/setup/marker_dictionary.hpp"

namespace perimap {
namespace {

constexpr int kLargestBoard = 60;  // squares a side that are tried

}  // namespace

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

namespace {

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

// Whether a marker stands in the layout as the plane image H of the layout has it: its own sides along rows and
// columns. A layout of another width fits many middles as well, and lies askew.
bool is_upright(const cv::Mat& H, const cv::Point2f& cell, const std::vector<cv::Point2f>& corners) {
  std::vector<cv::Point2f> ends{cell - cv::Point2f(0.3F, 0.0F), cell + cv::Point2f(0.3F, 0.0F),
                                cell - cv::Point2f(0.0F, 0.3F), cell + cv::Point2f(0.0F, 0.3F)};
  cv::perspectiveTransform(ends, ends, H);
  const auto cosine = [](const cv::Point2f& a, const cv::Point2f& b) {
    return a.dot(b) / std::max(1e-9, cv::norm(a) * cv::norm(b));
  };
  constexpr double kAlike = 0.95;
  return cosine(ends[1] - ends[0], corners[1] - corners[0]) > kAlike &&
         cosine(ends[3] - ends[2], corners[3] - corners[0]) > kAlike;
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
    if (d <= kNear && is_upright(H, board[i], markers.corners[i])) squares += d * d, count += 1.0;
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
  for (const MarkerDictionary& dictionary : marker_dictionaries()) {
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
    for (const MarkerDictionary& one : marker_dictionaries()) {
      if (one.name == prefix + std::to_string(size)) return one.id;
    }
  }
  return dictionary;
}

}  // namespace

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

}  // namespace perimap
