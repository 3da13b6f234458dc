#include "core/vision/instrument_mask.hpp"

#include <algorithm>
#include <exception>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "core/vision/opencv_threads.hpp"
#include "core/vision/widened_mask.hpp"

namespace perimap {
namespace {

std::vector<std::uint8_t> find(const cv::Mat& image, int width, int height, double least_margin_px) {
  constexpr int kLit_grey = 30;
  constexpr double kLeastSaturation = 0.18;                 // (largest - smallest) / largest of the three channels
  constexpr double kMargin = 1.0 / 80, kGlint = 1.0 / 160;  // of the image's width; a glint's radius
  cv::Mat small = image;
  const cv::Size reduced(reduced_side(width), reduced_side(height));
  if (image.cols > reduced.width || image.rows > reduced.height) {
    cv::resize(image, small, reduced, 0, 0, cv::INTER_AREA);
  }
  cv::Mat grey(small.size(), CV_8UC1, cv::Scalar(0));
  int lit = 0, unsaturated = 0;
  for (int y = 0; y < small.rows; ++y) {
    for (int x = 0; x < small.cols; ++x) {
      const cv::Vec3b& pixel = small.at<cv::Vec3b>(y, x);
      const int largest = std::max({pixel[0], pixel[1], pixel[2]}), smallest = std::min({pixel[0], pixel[1], pixel[2]});
      if (largest < kLit_grey) continue;
      ++lit;
      if (largest - smallest >= kLeastSaturation * largest) continue;
      ++unsaturated;
      grey.at<std::uint8_t>(y, x) = 255;
    }
  }
  const auto bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  std::vector<std::uint8_t> mask(bytes, 0);
  if (2 * unsaturated > lit) return mask;
  // Without the glints, which are small; they are barred as highlights.
  const int radius = std::clamp(static_cast<int>(kGlint * small.cols), 1, 2);
  const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1});
  cv::morphologyEx(grey, grey, cv::MORPH_OPEN, disc);
  grey = widened(grey, std::max(least_margin_px / kColourReduction, kMargin * small.cols));
  cv::Mat full(height, width, CV_8UC1, mask.data());
  cv::resize(grey, full, full.size(), 0, 0, cv::INTER_NEAREST);
  return mask;
}

}  // namespace

Expected<std::vector<std::uint8_t>> find_instruments(const ColourImage& image, int width, int height,
                                                     double least_margin_px) {
  if (image.bgr == nullptr || image.width < 1 || image.height < 1 || image.stride < 3 * image.width || width < 1 ||
      height < 1) {
    return fail("instrument mask: colour image of " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                " with stride " + std::to_string(image.stride) + " cannot be read");
  }
  try {
    keep_opencv_to_one_thread();
    // OpenCV takes no const data; find() only reads it.
    return find(cv::Mat(image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.bgr),
                        static_cast<std::size_t>(image.stride)),
                width, height, least_margin_px);
  } catch (const std::exception& error) {
    std::string what = error.what();
    std::replace(what.begin(), what.end(), '\n', ' ');
    return fail("instrument mask: " + what);
  }
}

}  // namespace perimap
