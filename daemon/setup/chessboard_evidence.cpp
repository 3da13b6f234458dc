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

// From square to square, each from what is dark, if the first square is, to what is bright. Squares that are not in the
// picture have none.
struct Steps {
  std::vector<double> between;   // of squares between the corners
  std::vector<double> around;    // to and among those beyond the outer corners
  std::vector<double> scatters;  // of each square between the corners
};

Steps steps_of(const cv::Mat& grey, const CornerGrid& grid, int columns, int rows) {
  const int width = columns + 1;
  std::vector<Square> squares;
  for (int y = -1; y < rows; ++y) {
    for (int x = -1; x < columns; ++x) squares.push_back(square_at(grey, grid, x, y));
  }
  const auto of = [&](int x, int y) { return squares[static_cast<std::size_t>(y * width + x)]; };
  const auto is_between = [&](int x, int y) { return x > 0 && y > 0 && x < columns && y < rows; };
  Steps steps;
  for (int y = 0; y <= rows; ++y) {
    for (int x = 0; x <= columns; ++x) {
      const Square here = of(x, y);
      if (std::isnan(here.level)) continue;
      const bool between = is_between(x, y);
      if (between) steps.scatters.push_back(here.scatter);
      const double sign = (x + y) % 2 == 0 ? 1.0 : -1.0;
      const auto step_to = [&](int to_x, int to_y) {
        if (to_x > columns || to_y > rows || std::isnan(of(to_x, to_y).level)) return;
        (between && is_between(to_x, to_y) ? steps.between : steps.around)
            .push_back(sign * (of(to_x, to_y).level - here.level));
      };
      step_to(x + 1, y);
      step_to(x, y + 1);
    }
  }
  return steps;
}

}  // namespace

bool is_chessboard(const cv::Mat& grey, const std::vector<cv::Point2f>& corners, int columns, int rows) {
  if (columns < 2 || rows < 2 || corners.size() != static_cast<std::size_t>(columns * rows)) return false;
  const CornerGrid grid(corners, columns, rows);
  if (!is_even(grid, columns, rows)) return false;
  const Steps steps = steps_of(grey, grid, columns, rows);
  constexpr std::size_t kFewest = 4;
  if (steps.between.size() < kFewest) return false;
  std::vector<double> sorted = steps.between;
  const double middle = upper_median(sorted.begin(), sorted.end());
  const double step = std::abs(middle);
  constexpr double kLeastStep = 10.0;  // grey levels
  constexpr double kMostScatter = 0.2;
  constexpr double kInTurn = 0.9;
  // What lies over the squares around the corners, or shades them, is between dark and bright, or as dark: a step the
  // wrong way round and half as high is another pattern's.
  constexpr double kContradicts = 0.5;
  constexpr double kMostContradictions = 0.1;
  const auto share_of = [](const std::vector<double>& values, const auto& is) {
    return static_cast<double>(std::count_if(values.begin(), values.end(), is)) /
           static_cast<double>(std::max<std::size_t>(1, values.size()));
  };
  std::vector<double> scatters = steps.scatters;
  return step >= kLeastStep && share_of(steps.between, [&](double s) { return s * middle > 0.0; }) >= kInTurn &&
         share_of(steps.around, [&](double s) { return s * middle < -kContradicts * middle * middle; }) <=
             kMostContradictions &&
         upper_median(scatters.begin(), scatters.end()) <= kMostScatter * step;
}

}  // namespace perimap
