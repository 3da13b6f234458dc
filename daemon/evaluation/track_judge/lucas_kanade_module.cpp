#include "daemon/evaluation/track_judge/lucas_kanade_module.hpp"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <string>

#include "core/vision/opencv_threads.hpp"

namespace perimap {
namespace {

tl::unexpected<Error> failed(const std::exception& error) {
  std::string what = error.what();
  std::replace(what.begin(), what.end(), '\n', ' ');
  return fail("Lucas-Kanade: " + what);
}

// OpenCV takes no const data; what is borrowed here is only read.
cv::Mat borrow(const GreyImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
          static_cast<std::size_t>(image.stride)};
}

class OpenCvLucasKanade final : public LucasKanade {
 public:
  Expected<std::vector<Vector2d>> corners(const GreyImage& image, int most) override {
    constexpr double kQuality = 0.01, kDistance_px = 10;
    try {
      std::vector<cv::Point2f> found;
      cv::goodFeaturesToTrack(borrow(image), found, most, kQuality, kDistance_px);
      std::vector<Vector2d> corners;
      corners.reserve(found.size());
      for (const cv::Point2f& px : found) corners.emplace_back(px.x, px.y);
      return corners;
    } catch (const std::exception& thrown) {
      return failed(thrown);
    }
  }

  Expected<void> track_points(const GreyImage& from, const GreyImage& to,
                              std::vector<std::optional<Vector2d>>& points) override {
    constexpr int kLevelsAboveFirst = 3;
    constexpr double kMostOff_px = 1;
    try {
      std::vector<cv::Point2f> begins, ends, back;
      for (const auto& px : points) {
        if (px) begins.emplace_back(static_cast<float>(px->x()), static_cast<float>(px->y()));
      }
      if (begins.empty()) return {};
      std::vector<std::uint8_t> there, and_back;
      std::vector<float> residuals;
      const cv::Size window(21, 21);
      cv::calcOpticalFlowPyrLK(borrow(from), borrow(to), begins, ends, there, residuals, window, kLevelsAboveFirst);
      cv::calcOpticalFlowPyrLK(borrow(to), borrow(from), ends, back, and_back, residuals, window, kLevelsAboveFirst);
      std::size_t k = 0;
      for (auto& px : points) {
        if (!px) continue;
        const bool is_found = there[k] != 0 && and_back[k] != 0 && cv::norm(back[k] - begins[k]) < kMostOff_px &&
                              ends[k].x >= 0 && ends[k].y >= 0 && ends[k].x < static_cast<float>(to.width) &&
                              ends[k].y < static_cast<float>(to.height);
        px = is_found ? std::optional(Vector2d(ends[k].x, ends[k].y)) : std::nullopt;
        ++k;
      }
      return {};
    } catch (const std::exception& thrown) {
      return failed(thrown);
    }
  }
};

Expected<std::unique_ptr<LucasKanade>> create() { return std::make_unique<OpenCvLucasKanade>(); }

}  // namespace
}  // namespace perimap

const perimap::LucasKanadeModule* perimap_lucas_kanade_module() {
  static constexpr perimap::LucasKanadeModule kModule{&perimap::create};
  perimap::keep_opencv_to_one_thread();
  return &kModule;
}
