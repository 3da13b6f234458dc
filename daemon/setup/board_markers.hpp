// ArUco and AprilTag markers: found in a picture, and the board that they tell by their numbers.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/setup/board.hpp"

namespace perimap {

struct Markers {
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;  // px, four each
};

[[nodiscard]] Markers markers_in(const cv::Mat& grey, int dictionary);

[[nodiscard]] cv::Point2f middle_of(const std::vector<cv::Point2f>& corners);

// Column and row of a marker's square in a layout of so many columns; x counted from the left, y downwards.
struct Cell {
  double x;
  double y;
};
enum class Layout { kCharucoBlackFirst, kCharucoWhiteFirst, kGridDown, kGridUp };

[[nodiscard]] Cell cell_of(int id, int columns, Layout layout);

// The board whose markers most of the pictures show; none when none shows six that fit a layout.
[[nodiscard]] std::optional<Board> recognise_markers(const std::vector<cv::Mat>& pictures, const BoardWish& wish);

}  // namespace perimap
