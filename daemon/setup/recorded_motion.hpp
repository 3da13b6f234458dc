// A scope's motion as camera and tracker recorded it, before a board.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/timed_poses.hpp"
#include "core/calibration/turned_scope.hpp"
#include "core/geometry/camera_model.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/setup/board.hpp"
#include "daemon/setup/recorded_board.hpp"
#include "drivers/calibration/lens_covariance.hpp"

namespace perimap {

// Where the lens and the motion come from.
struct MotionSource {
  std::string recording;
  std::string calibration;                  // the lens; empty: that of the first configuration which names one
  std::vector<std::string> configurations;  // files; those without a name do not count
  BoardWish board;
  std::string
      board_tool;  // the tracked tool that is fast on the board, which then may move; empty: the board lies still
  // In place of the lens's own focal length and principal point: the scope is turned or zoomed otherwise now.
  std::optional<LensAtTurn> lens_as_turned = std::nullopt;
};

struct KnownLens {
  CameraModel camera;
  std::optional<LensCovariance> covariance;  // none: its calibration says none
};

// Fails when neither the calibration nor a configuration says it.
[[nodiscard]] SetupExpected<KnownLens> lens_of(const MotionSource& source);

// What recorded_motion() needs besides the recording: the board's size, without which lengths would be in squares, and
// the lens.
[[nodiscard]] SetupExpected<void> check_source(const MotionSource& source);

// The poses of a tool of the recording in the frame in which the board lies still: the tracker's, or that of the tool
// on the board.
[[nodiscard]] Expected<std::vector<TimedPose>> poses_beside_board(const MotionSource& source, const std::string& tool);

struct RecordedMotion {
  RecordedBoard board;
  KnownLens lens;
  std::vector<TimedPose> camera_poses;  // X_BC, on the camera's clock
  std::vector<TimedPose> sensor_poses;  // X_WS, on the tracker's; W is the board's tool where it has one
};

// `progress` hears of the frames that were looked at, of all that will be.
[[nodiscard]] SetupExpected<RecordedMotion> recorded_motion(
    const MotionSource& source, const std::function<void(std::uint64_t done, std::uint64_t all)>& progress);

}  // namespace perimap
