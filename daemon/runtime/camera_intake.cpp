#include "daemon/runtime/camera_intake.hpp"

#include <chrono>

namespace perimap {

void CameraIntake::reserve(int width, int height) {
  grey_.reserve(width, height);
  colour_.reserve(width, height);
}

bool CameraIntake::deliver_frame(const CameraFrame& frame) {
  if (intake_.entrance == nullptr) {
    // Without a pipeline nobody needs it in grey.
    intake_.frame(frame, {}, {});
    return true;
  }
  const auto grey = grey_.convert(frame);
  if (!grey) {
    SensorIntake{nullptr, intake_.recorder}.frame(frame, {}, {});
    return false;
  }
  const bool first = !before_;
  // Only the first one's goes with itself, to tell at once that there is any.
  if (first) colour_.reduce_colour(frame);
  intake_.frame(frame, *grey, first ? colour_.picture() : colour_for(frame));
  if (!first) colour_.reduce_colour(frame);
  before_ = frame.stamp.capture;
  return true;
}

ColourImage CameraIntake::colour_for(const CameraFrame& frame) {
  // After an interruption instruments may be anywhere. A frame that is lost between the two is none.
  constexpr Duration kOldest = std::chrono::milliseconds(250);
  return frame.stamp.capture - *before_ <= kOldest ? colour_.picture() : ColourImage{};
}

}  // namespace perimap
