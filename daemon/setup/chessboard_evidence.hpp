// Whether what a corner finder takes for a small chessboard is one: texture has grids of a few corners by chance.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

namespace perimap {

// Grids of more corners are not found in texture.
inline constexpr int kMostCornersByChance = 30;

// `corners`: columns x rows of them, row by row. A chessboard's squares between the corners are dark and bright in
// turn, each of one grey level beside the step to its neighbours, and its rows and columns are nearly even and
// straight. Those around the outer corners may be held by fingers or lie in the dark; they only must not be dark and
// bright the other way round.
[[nodiscard]] bool is_chessboard(const cv::Mat& grey, const std::vector<cv::Point2f>& corners, int columns, int rows);

}  // namespace perimap
