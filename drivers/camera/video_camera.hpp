// A video file in place of a camera, for development: its frames at its own pace, stamped as if just exposed.
#pragma once

#include <string>

#include "core/error/expected.hpp"
#include "drivers/device/device_health.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

struct VideoCameraSettings {
  std::string file;
  double frame_rate_hz = 0.0;  // 0: the file's own, or 30 when it tells none
  bool loop = true;            // begins anew at its end
  int width = 0;               // that the frames must have, with height; 0: any
  int height = 0;
};

// Frames have the times that the file gives them; with `frame_rate_hz`, or where it gives none, they come evenly.
//
// Runs on the calling thread until interrupted, or to the end without `loop`. Frames that cannot be decoded in time are
// passed over, as a camera would, and counted in health.lost. Fails when the file cannot be read, or its frames have
// another size.
[[nodiscard]] Expected<void> serve_video_camera(const VideoCameraSettings& settings, const CameraSink& sink,
                                                DeviceHealth& health, const Interrupt& interrupt);

}  // namespace perimap
