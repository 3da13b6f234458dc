// A simulated session that no file is to hold, told in the words of `perimap simulate`.
#pragma once

#include <string>

#include "core/error/expected.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap {

struct UnrecordedOptions {
  SimulationSettings settings;
  TrackerNoise noise;
  unsigned threads = 1;  // that render
  bool tool = false;     // a tracked probe touches the heart
};

// `text`: options of `perimap simulate`, taken apart as a shell would. What concerns files that it writes, or a bench,
// is refused by its name. Errors: a line for each thing that is wrong, such as "--simulated: --sead: is no option; did
// you mean --seed?", where `option` is "--simulated".
[[nodiscard]] Expected<UnrecordedOptions> parse_unrecorded(const std::string& option, const std::string& text);

}  // namespace perimap
