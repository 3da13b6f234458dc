#include "daemon/setup/chessboard_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

// Corners, and beyond the outer ones where the next would be.
class CornerGrid {
 public:
  CornerGrid(const std::vector<cv::Point2f>& corners, int columns, int rows)
      : corners_(corners), columns_(columns), rows_(rows) {}

  [[nodiscard]] cv::Point2f at(int x, int y) const {
    if (x < 0) return 2.0F * at(0, y) - at(1, y);
    if (x >= columns_) return 2.0F * at(columns_ - 1, y) - at(columns_ - 2, y);
    if (y < 0) return 2.0F * at(x, 0) - at(x, 1);
    if (y >= rows_) return 2.0F * at(x, rows_ - 1) - at(x, rows_ - 2);
    return corners_[static_cast<std::size_t>(y * columns_ + x)];
  }

 private:
  const std::vector<cv::Point2f>& corners_;
  int columns_;
  int rows_;
};

struct Square {
  double level = std::numeric_limits<double>::quiet_NaN();  // not a number: out of the picture
  double scatter = 0.0;
};

// Of the inner half of the square whose first corner is (x, y).
Square square_at(const cv::Mat& grey, const CornerGrid& grid, int x, int y) {
  const cv::Point2f a = grid.at(x, y), b = grid.at(x + 1, y), c = grid.at(x, y + 1), d = grid.at(x + 1, y + 1);
  constexpr int kSamples = 7;  // a side
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < kSamples; ++i) {
    for (int j = 0; j < kSamples; ++j) {
      const float u = 0.25F + 0.5F * static_cast<float>(i) / (kSamples - 1);
      const float v = 0.25F + 0.5F * static_cast<float>(j) / (kSamples - 1);
      const cv::Point2f p = (1 - v) * ((1 - u) * a + u * b) + v * ((1 - u) * c + u * d);
      const int px = static_cast<int>(std::lround(p.x));
      const int py = static_cast<int>(std::lround(p.y));
      if (px < 0 || py < 0 || px >= grey.cols || py >= grey.rows) return {};
      const double level = grey.at<unsigned char>(py, px);
      sum += level, squares += level * level;
    }
  }
  constexpr double kCount = kSamples * kSamples;
  const double mean = sum / kCount;
  return {mean, std::sqrt(std::max(0.0, squares / kCount - mean * mean))};
}

bool is_even(const CornerGrid& grid, int columns, int rows) {
  constexpr double kMostBent = 0.25;  // of a side
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const auto bent = [](const cv::Point2f& before, const cv::Point2f& at, const cv::Point2f& after) {
        return cv::norm(before - 2.0F * at + after) > kMostBent * cv::norm(after - before);
      };
      if (x > 0 && x + 1 < columns && bent(grid.at(x - 1, y), grid.at(x, y), grid.at(x + 1, y))) return false;
      if (y > 0 && y + 1 < rows && bent(grid.at(x, y - 1), grid.at(x, y), grid.at(x, y + 1))) return false;
    }
  }
  return true;
}

}  // namespace

bool is_chessboard(const cv::Mat& grey, const std::vector<cv::Point2f>& corners, int columns, int rows) {
  if (columns < 2 || rows < 2 || corners.size() != static_cast<std::size_t>(columns * rows)) return false;
  const CornerGrid grid(corners, columns, rows);
  if (!is_even(grid, columns, rows)) return false;
  const int width = columns + 1;
  std::vector<Square> squares;
  for (int y = -1; y < rows; ++y) {
    for (int x = -1; x < columns; ++x) squares.push_back(square_at(grey, grid, x, y));
  }
  const auto of = [&](int x, int y) { return squares[static_cast<std::size_t>(y * width + x)]; };
  std::vector<double> steps;  // from what is dark, if the first square is, to what is bright
  std::vector<double> scatters;
  for (int y = 0; y <= rows; ++y) {
    for (int x = 0; x <= columns; ++x) {
      const Square here = of(x, y);
      if (std::isnan(here.level)) continue;
      scatters.push_back(here.scatter);
      const double sign = (x + y) % 2 == 0 ? 1.0 : -1.0;
      if (x < columns && !std::isnan(of(x + 1, y).level)) steps.push_back(sign * (of(x + 1, y).level - here.level));
      if (y < rows && !std::isnan(of(x, y + 1).level)) steps.push_back(sign * (of(x, y + 1).level - here.level));
    }
  }
  if (steps.size() < 4) return false;
  std::vector<double> sorted = steps;
  const double middle = upper_median(sorted.begin(), sorted.end());
  const double step = std::abs(middle);
  constexpr double kLeastStep = 10.0;  // grey levels
  constexpr double kMostScatter = 0.2;
  constexpr double kInTurn = 0.9;
  const auto in_turn = std::count_if(steps.begin(), steps.end(), [&](double s) { return s * middle > 0.0; });
  return step >= kLeastStep && static_cast<double>(in_turn) >= kInTurn * static_cast<double>(steps.size()) &&
         upper_median(scatters.begin(), scatters.end()) <= kMostScatter * step;
}

}  // namespace perimap
