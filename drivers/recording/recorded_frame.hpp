// A recorded camera frame in grey.
#pragma once

#include <optional>

#include "core/error/expected.hpp"
#include "core/sensors/grey_image.hpp"
#include "drivers/image/grey_converter.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

class RecordedFrame {
 public:
  // Of either of the types that a camera's channel can have. The image is valid until the next call. Errors have the
  // form of RecordingReader's.
  [[nodiscard]] Expected<GreyImage> read(const RecordingReader& reader, const RecordedMessage& message);

 private:
  std::optional<Sample<foxglove_RawImage>> raw_;
  std::optional<Sample<foxglove_CompressedImage>> compressed_;
  GreyConverter converter_;
};

}  // namespace perimap
