// What calibrations from a recording are told, and the recording's poses and views by it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/calibration/timed_poses.hpp"
#include "core/calibration/turned_scope.hpp"
#include "core/geometry/camera_model.hpp"
#include "daemon/command_line/console.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/setup/commands/board_options.hpp"
#include "daemon/setup/recorded_board.hpp"

namespace perimap {

class Command;
struct RecordedOptions {
  std::string recording;    // empty: not from a recording
  std::string calibration;  // the lens; empty: the configuration's
  std::string live;         // the configuration of live devices, whose lens it is where no other says it
  BoardOptions board;
  // In place of the lens's own focal length and principal point: the scope is turned or zoomed otherwise now.
  std::optional<LensAtTurn> lens_as_turned = std::nullopt;
};

// --from.
void add_from(Command& command, std::string& recording);
// --calibration, and the board's.
void add_lens_and_board(Command& command, RecordedOptions& options);

// By --calibration, else by what the configuration names; empty: there is none. Fails when neither says it.
[[nodiscard]] SetupExpected<CameraModel> lens_of(const RecordedOptions& options, const std::string& configuration);

// What recorded_motion() needs besides the recording: the board's size and the lens.
[[nodiscard]] SetupExpected<void> check_motion_options(const RecordedOptions& options,
                                                       const std::string& configuration);

struct RecordedMotion {
  RecordedBoard board;
  CameraModel camera;
  std::vector<TimedPose> camera_poses;  // X_BC, on the camera's clock
  std::vector<TimedPose> sensor_poses;  // X_WS, on the tracker's
};

// The scope's motion as camera and tracker saw it. Fails when the board's size is not told, with which lengths would be
// in squares.
[[nodiscard]] SetupExpected<RecordedMotion> recorded_motion(const RecordedOptions& options,
                                                            const std::string& configuration, const Console& console);

}  // namespace perimap
