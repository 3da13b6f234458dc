// What a theatre is told in words and bare numbers, as a command line has them.
#pragma once

#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/standins/theatre/theatre.hpp"

namespace perimap {

struct TheatreWords {
  std::vector<double> missing_s;      // every, for; or nothing
  std::vector<double> unplug_s;       // likewise
  std::vector<double> ndi_reference;  // translation mm, then rotation wxyz; or nothing
  std::vector<std::string> tools;     // NAME=MOTION
  std::vector<std::string> broken;    // port handles
  std::vector<double> frame_jump;     // every s, by frames; or nothing
};

// The settings with all of that. Errors begin with the option's name.
[[nodiscard]] Expected<TheatreSettings> with_words(TheatreSettings settings, const TheatreWords& words);

// NAME or NAME=WHERE each, as they can be emulated with these settings. `can_given`: something is said of frames over
// CAN, which takes a device that sends them.
[[nodiscard]] Expected<std::vector<EmulatedDevice>> parse_emulated_devices(const std::vector<std::string>& texts,
                                                                           const TheatreSettings& settings,
                                                                           bool can_given);

}  // namespace perimap
