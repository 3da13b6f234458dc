// An emulated camera: the frames of a recording, or of a simulated heart, out of a V4L2 video output.
#pragma once

#include <cstdint>
#include <string>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/camera/v4l2_node.hpp"
#include "drivers/standins/emulator/emulator_faults.hpp"
#include "drivers/standins/emulator/emulator_server.hpp"
#include "drivers/standins/emulator/played_frames.hpp"
#include "drivers/transport/interrupt.hpp"

namespace perimap {

struct ShownFrames {
  std::uint64_t shown = 0;
  std::uint64_t faulty = 0;    // of these, cut short on request
  std::uint64_t lost = 0;      // left out on request
  std::uint64_t refused = 0;   // the output had not shown those before
  std::uint64_t too_slow = 0;  // could not be rendered in time
};

// Each frame comes when it arrived, `start` being when the session's first message does, and is stamped with its
// capture (v4l2loopback keeps that stamp; others stamp their own). Of the faults it knows lost and truncated frames,
// drift, and unplugging, which closes the output; frames whose time is over by the first opening, and those of the
// meantime, are gone. Runs on the calling thread until interrupted or played to its end.
[[nodiscard]] Expected<ShownFrames> emulate_camera(const std::string& device, PlayedFrames& frames, Instant start,
                                                   const EmulatorFaults& faults, const EmulatorReady& ready,
                                                   const Interrupt& interrupt,
                                                   const V4l2Opener& open = &open_v4l2_node);

}  // namespace perimap
