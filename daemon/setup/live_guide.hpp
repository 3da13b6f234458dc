// What a user is told while a calibration is recorded: what is there, what is missing, and how good it is so far.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/timed_poses.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/sensors/grey_image.hpp"
#include "daemon/setup/board.hpp"
#include "daemon/setup/recorded_board.hpp"

namespace perimap {

// Of one thread.
class LiveGuide {
 public:
  LiveGuide() = default;
  LiveGuide(const LiveGuide&) = delete;
  LiveGuide& operator=(const LiveGuide&) = delete;
  virtual ~LiveGuide() = default;

  // The newest frame; not all are shown. `t_s`: on the camera's clock.
  virtual void see(double t_s, const GreyImage& grey) = 0;
  // All poses so far of the tool that matters.
  virtual void follow(const std::vector<TimedPose>& poses) = 0;
  // One line.
  [[nodiscard]] virtual std::string line() const = 0;
  // Whether there is enough of everything.
  [[nodiscard]] virtual bool enough() const = 0;
};

// The board from all sides: in which ninths of the picture it was, and, where the lens is known, how far the tracked
// scope was turned and what a hand-eye calibration would leave over by now.
[[nodiscard]] std::unique_ptr<LiveGuide> board_guide(const BoardWish& wish, std::optional<CameraModel> camera,
                                                     double least_s);
// A tool swung about its tip: how far it was turned, and what a calibration would leave over by now.
[[nodiscard]] std::unique_ptr<LiveGuide> pivot_guide(double least_s);
// A sensor that lies still: for how long.
[[nodiscard]] std::unique_ptr<LiveGuide> still_guide(double least_s);

}  // namespace perimap
