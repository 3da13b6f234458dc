// Calibrations from live devices: what they give is recorded while the user is told what is missing, and then measured
// as from any recording.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "daemon/command_line/console.hpp"
#include "daemon/command_line/outcome.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/live_guide.hpp"
#include "daemon/setup/live_recording.hpp"

namespace perimap {

class Command;

// Without a configuration: not live.
using LiveOptions = LiveSettings;

// --live, --seconds and --keep.
void add_live(Command& command, LiveOptions& options);

// For a board; with the lens, where it is known, it tells what is left over by now. One that guides nobody when the
// options are not live. `configuration`: as source_of() takes it.
[[nodiscard]] SetupExpected<std::unique_ptr<LiveGuide>> live_board_guide(const LiveOptions& options,
                                                                         const RecordedOptions& recorded,
                                                                         const std::string& configuration,
                                                                         double least_s);

// Does `measure` with the recording that --from names or, live, that is made now: `recording` is then that. In what is
// told of one that is taken away again the configuration's name stands for it.
[[nodiscard]] Outcome with_recording(const LiveOptions& options, const std::string& tool, LiveGuide& guide,
                                     const Console& console, std::string& recording,
                                     const std::function<Outcome()>& measure);

}  // namespace perimap
