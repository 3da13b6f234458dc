// Masks with a margin.
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace perimap {

// 255 wherever `mask` (8 bits) is not 0 within by_px. The distance transform costs the same whatever the reach;
// dilation does not.
[[nodiscard]] inline cv::Mat widened(const cv::Mat& mask, double by_px) {
  cv::Mat away, distance;
  cv::compare(mask, 0, away, cv::CMP_EQ);
  cv::distanceTransform(away, distance, cv::DIST_L2, cv::DIST_MASK_3);
  return distance <= by_px;
}

}  // namespace perimap
