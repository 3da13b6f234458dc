// A recorded camera frame in grey, and its colour.
#pragma once

#include <optional>

#include "core/error/expected.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/grey_image.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/image/colour_reducer.hpp"
#include "drivers/image/grey_converter.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

class RecordedFrame {
 public:
  // Of the frames that are asked for colour, one in so long is looked at.
  explicit RecordedFrame(Duration colour_interval = ColourReducer::kUsualInterval) : colour_(colour_interval) {}

  // Of either of the types that a camera's channel can have. Errors have the form of RecordingReader's. The others are
  // about the frame read last, and valid until the next one is.
  [[nodiscard]] Expected<void> read(const RecordingReader& reader, const RecordedMessage& message);
  // Without its stamp.
  [[nodiscard]] const CameraFrame& as_it_came() const noexcept { return frame_; }
  // An error when it cannot be decoded.
  [[nodiscard]] Expected<GreyImage> grey() { return converter_.convert(frame_); }
  // Without pixels when it has none, or was not looked at.
  [[nodiscard]] const ColourImage& colour();

 private:
  std::optional<Sample<foxglove_RawImage>> raw_;
  std::optional<Sample<foxglove_CompressedImage>> compressed_;
  CameraFrame frame_;
  GreyConverter converter_;
  ColourReducer colour_;
};

}  // namespace perimap
