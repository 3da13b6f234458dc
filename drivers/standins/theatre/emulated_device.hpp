// What may be emulated, and where it is then found.
#pragma once

#include <string>

#include "core/error/expected.hpp"
#include "drivers/standins/emulator/emulator_faults.hpp"
#include "drivers/transport/endpoint.hpp"

namespace perimap {

struct EmulatedDevice {
  std::string name;  // ndi, igtl, medlab, bitalino, cyton, can-ecg or camera
  Endpoint where;
  std::string video_output = {};  // of a camera, in its place
};

// NAME, at its usual place, or NAME=WHERE.
[[nodiscard]] Expected<EmulatedDevice> parse_emulated_device(const std::string& text);

// Over CAN, and out of a video output, there are no bytes to damage.
[[nodiscard]] Expected<void> check_faults(const EmulatedDevice& device, const EmulatorFaults& faults);

}  // namespace perimap
