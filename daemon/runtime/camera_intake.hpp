// A camera's frames on their way into the pipeline and the recording.
#pragma once

#include <optional>

#include "core/time/instant.hpp"
#include "daemon/runtime/sensor_intake.hpp"
#include "drivers/image/colour_reducer.hpp"
#include "drivers/image/grey_converter.hpp"

namespace perimap {

// Belongs to the camera's thread. A frame does not wait for its colour: that goes with the next one, if it comes soon.
class CameraIntake {
 public:
  explicit CameraIntake(const SensorIntake& intake) : intake_(intake) {}

  // Makes room, so that frames of up to this size allocate nothing; JPEGs excepted.
  void reserve(int width, int height);

  // False when the frame cannot be decoded: it is recorded as it came, and to the pipeline it is a gap in the count.
  bool deliver_frame(const CameraFrame& frame);

 private:
  [[nodiscard]] ColourImage colour_for(const CameraFrame& frame);

  const SensorIntake& intake_;
  GreyConverter grey_;
  ColourReducer colour_;
  std::optional<Instant> before_;  // when the frame was captured whose colour colour_ has
};

}  // namespace perimap
