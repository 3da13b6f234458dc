// A calibration board as a recording's camera saw it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/calibration/timed_poses.hpp"
#include "core/error/expected.hpp"
#include "core/geometry/camera_model.hpp"
#include "daemon/setup/board.hpp"

namespace perimap {

struct TimedView {
  double t_s = 0.0;  // on the camera's clock
  BoardView view;
};

struct RecordedBoard {
  Board board;
  int width = 0;  // px, of the frames
  int height = 0;
  std::size_t frames = 0;  // that were looked at
  std::vector<TimedView> views;
};

// Calls `look` with so many frames a second, evenly: their time on the camera's clock and their picture, valid for that
// call. Fails when the recording has no frames, or they change their size.
[[nodiscard]] Expected<void> for_each_recorded_frame(
    const std::string& recording, double frames_per_s,
    const std::function<void(double t_s, const GreyImage& grey)>& look);

// Looks for the board in so many frames a second, evenly. `progress` hears of the frames that were looked at, of all
// that will be. Fails when the recording has no frames, they change their size, or none shows a board.
[[nodiscard]] Expected<RecordedBoard> find_recorded_board(
    const std::string& recording, const BoardWish& wish, double frames_per_s,
    const std::function<void(std::uint64_t done, std::uint64_t all)>& progress);

// The camera in the board's frame, X_BC, by each view: the least squares of its points. Views that no pose explains are
// left out. Lengths are those of the views.
[[nodiscard]] std::vector<TimedPose> camera_poses_of(const std::vector<TimedView>& views, const CameraModel& camera);

}  // namespace perimap
