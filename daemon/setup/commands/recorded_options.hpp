// What calibrations from a recording are told.
#pragma once

#include <string>

#include "daemon/command_line/console.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/setup/commands/board_options.hpp"
#include "daemon/setup/recorded_motion.hpp"

namespace perimap {

class Command;
struct RecordedOptions {
  std::string recording;    // empty: not from a recording
  std::string calibration;  // the lens; empty: the configuration's
  std::string live;         // the configuration of live devices, whose lens it is where no other says it
  BoardOptions board;
  std::string board_tool;  // fast on the board; empty: the board lies still
};

// --from.
void add_from(Command& command, std::string& recording);
// --calibration, and the board's.
void add_lens_and_board(Command& command, RecordedOptions& options);
// Whether one of those was given.
[[nodiscard]] bool has_lens_or_board(const RecordedOptions& options);

// `configuration`: that of --configuration, or of the command itself; its lens goes before the live devices'.
[[nodiscard]] SetupExpected<MotionSource> source_of(const RecordedOptions& options, const std::string& configuration);

// Before anything is recorded: what recorded_motion() needs besides.
[[nodiscard]] SetupExpected<void> check_motion_options(const RecordedOptions& options,
                                                       const std::string& configuration);

// With its progress on the console.
[[nodiscard]] SetupExpected<RecordedMotion> motion_of(const RecordedOptions& options, const std::string& configuration,
                                                      const Console& console);

}  // namespace perimap
