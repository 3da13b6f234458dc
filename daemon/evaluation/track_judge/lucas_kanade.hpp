// What users would otherwise take to follow features: OpenCV's corners and pyramidal Lucas-Kanade, to be held against.
// In a module that is loaded when it is asked for, since it brings so much.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/sensors/grey_image.hpp"

namespace perimap {

// Corners of quality 0.01, 10 px apart (cv::goodFeaturesToTrack); windows of 21 x 21, three levels above the first
// (cv::calcOpticalFlowPyrLK); a point counts as found when the way back ends within 1 px of where it began.
class LucasKanade {
 public:
  // Fails where the module is not there.
  [[nodiscard]] static Expected<std::unique_ptr<LucasKanade>> create();
  LucasKanade() = default;
  LucasKanade(LucasKanade&&) = delete;
  LucasKanade& operator=(LucasKanade&&) = delete;
  LucasKanade(const LucasKanade&) = delete;
  LucasKanade& operator=(const LucasKanade&) = delete;
  virtual ~LucasKanade() = default;

  [[nodiscard]] virtual Expected<std::vector<Vector2d>> corners(const GreyImage& image, int most) = 0;

  // Takes the points of one image into the next, of the same size. Those that are not found become empty; empty ones
  // stay so.
  [[nodiscard]] virtual Expected<void> track_points(const GreyImage& from, const GreyImage& to,
                                                    std::vector<std::optional<Vector2d>>& points) = 0;
};

}  // namespace perimap
