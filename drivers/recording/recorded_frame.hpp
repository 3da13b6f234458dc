// A recorded camera frame in grey, and its colour.
#pragma once

#include <optional>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"
#include "drivers/image/colour_reducer.hpp"
#include "drivers/image/grey_converter.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

class RecordedFrame {
 public:
  // Colour is looked at in every so manieth frame alone.
  explicit RecordedFrame(int colour_interval_frames = ColourReducer::kUsualInterval)
      : colour_(colour_interval_frames) {}

  // Of either of the types that a camera's channel can have. The image is valid until the next call. Errors have the
  // form of RecordingReader's.
  [[nodiscard]] Expected<GreyImage> read(const RecordingReader& reader, const RecordedMessage& message);
  // Of the frame read last; without pixels when it has none, or was not looked at.
  [[nodiscard]] const ColourImage& colour() const noexcept { return colour_.picture(); }

 private:
  std::optional<Sample<foxglove_RawImage>> raw_;
  std::optional<Sample<foxglove_CompressedImage>> compressed_;
  GreyConverter converter_;
  ColourReducer colour_;
};

}  // namespace perimap
