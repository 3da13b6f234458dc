// A V4L2 camera, opened again when it goes.
#pragma once

#include <cstdint>

#include "drivers/camera/v4l2_node.hpp"
#include "drivers/camera/v4l2_stream.hpp"
#include "drivers/device/device_health.hpp"
#include "drivers/image/camera_frame.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

// A driver's count of frames, 32 bits and from 0 at each opening, as one count over all openings.
class FrameCount {
 public:
  // The next frame is the first of an opening; what passed meanwhile nobody knows.
  void reopen() noexcept { open_ = false; }
  // The count of the frame that the driver calls `sequence`. One that does not go on (a driver without a count gives
  // zeros) is the next.
  std::uint64_t next(std::uint32_t sequence) noexcept;
  // Frames that the last call passed over.
  [[nodiscard]] std::uint64_t gap() const noexcept { return gap_; }

 private:
  bool open_ = false;
  std::uint32_t sequence_ = 0;
  std::uint64_t count_ = 0;
  std::uint64_t gap_ = 0;
};

// Runs on the calling thread until interrupted. The sink's frames have one count over all openings; a gap is what the
// driver lost (health.lost) or what came damaged (health.damaged). A camera that gives nothing for half a second is
// silent, after three seconds it is opened anew.
void serve_v4l2_camera(const V4l2Settings& settings, const CameraSink& sink, DeviceHealth& health,
                       const Interrupt& interrupt, const V4l2Opener& open = &open_v4l2_node);

}  // namespace perimap
