// The readings of one tracked tool, all of a recording's.
#pragma once

#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

// Of this channel, in the order of the recording, those without a pose too. The reader then stands at its end.
[[nodiscard]] Expected<std::vector<TrackerSample>> read_tracker_samples(RecordingReader& reader,
                                                                        std::string_view channel);

}  // namespace perimap
