// The beats of a recording's ECG as the pipeline comes to know them.
#pragma once

#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/phase/r_peak.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

// In order of time, classed, on the recording's clock; `detected_at` is the arrival of the block that made the beat
// known. What the classer takes for noise is left out.
[[nodiscard]] Expected<std::vector<RPeak>> load_beats(const std::string& recording, ReadMode mode);

}  // namespace perimap
