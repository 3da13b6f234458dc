// The configuration that `perimap setup` writes: the devices that are there, and what is to be measured yet.
#pragma once

#include <string>

namespace perimap {

// What is empty is not there.
struct SetupAnswers {
  std::string camera;            // as camera.device takes it
  std::string calibration;       // file
  std::string tracker_protocol;  // ndi, igtl
  std::string tracker_port;
  std::string ecg_protocol;
  std::string ecg_port;
};

// With a comment above each key. What is to be measured is commented out, with the command that measures it and sets it
// in `file`, as this text is to be called.
[[nodiscard]] std::string first_configuration(const SetupAnswers& answers, const std::string& file,
                                              const std::string& date);

}  // namespace perimap
