// What the commands have in common that measure by a motion which camera and tracker both recorded: of a recording or
// of live devices, in which a board is in view, or of files.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "daemon/command_line/command.hpp"
#include "daemon/command_line/console.hpp"
#include "daemon/command_line/outcome.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/setup/commands/live_capture.hpp"
#include "daemon/setup/commands/measurement.hpp"
#include "daemon/setup/commands/recorded_options.hpp"
#include "daemon/setup/hand_eye.hpp"

namespace perimap {

struct BoardMotionOptions {
  CommonOptions common;
  RecordedOptions recorded;
  LiveOptions live;

  [[nodiscard]] bool is_recorded() const { return !recorded.recording.empty(); }
};

// --from, --live, --calibration and the board's.
void add_board_motion(Command& command, BoardMotionOptions& options);

// Hand-eye and offset of the clocks by the recording.
[[nodiscard]] SetupExpected<HandEyeCalibration> hand_eye_of(const BoardMotionOptions& options,
                                                            const HandEyeSettings& settings, const Console& console);

// Records where devices are live, measures and finishes. `files` are what is read in the place of a recording. What can
// be refused is refused before anything is recorded.
[[nodiscard]] Outcome measure_motion(BoardMotionOptions& options, const std::vector<std::string>& files,
                                     const Console& console,
                                     const std::function<SetupExpected<Measurement>()>& measure);

}  // namespace perimap
