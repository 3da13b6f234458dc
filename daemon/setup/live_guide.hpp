// What a user is told while a calibration is recorded: what is there, what is missing, and how good it is so far.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/timed_poses.hpp"
#include "core/sensors/grey_image.hpp"
#include "daemon/setup/board.hpp"
#include "daemon/setup/recorded_board.hpp"
#include "daemon/setup/recorded_motion.hpp"

namespace perimap {

// Of which tools a guide needs the poses: of none, of the one that matters, or of that and a second sensor.
enum class Followed { kNone, kTool, kBothSensors };

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
  // Likewise of a second sensor, where the configuration names one.
  virtual void follow_second(const std::vector<TimedPose>& /*poses*/) {}
  [[nodiscard]] virtual Followed followed() const { return Followed::kTool; }
  // One line.
  [[nodiscard]] virtual std::string line() const = 0;
  // How much of what is wanted of each ninth of the picture was seen, 0 to 1, row by row. Empty: it does not matter
  // where in the picture.
  [[nodiscard]] virtual std::vector<double> seen_of_ninths() const { return {}; }
  // Whether there is enough of everything.
  [[nodiscard]] virtual bool enough() const = 0;
};

// Whether the tracked scope must be turned about the board for what is measured.
enum class Turning { kNotWanted, kWanted };

// The board from all sides: in which ninths of the picture it was, and, where that is wanted or the lens is known, how
// far the tracked scope was turned; by the lens, what a hand-eye calibration would leave over by now.
[[nodiscard]] std::unique_ptr<LiveGuide> board_guide(const BoardWish& wish, std::optional<KnownLens> lens,
                                                     double least_s, Turning turning = Turning::kNotWanted);
// A tool swung about its tip: how far it was turned, what a calibration would leave over by now, and how well it would
// know the tip.
[[nodiscard]] std::unique_ptr<LiveGuide> pivot_guide(double least_s);
// A sensor that lies still: for how long.
[[nodiscard]] std::unique_ptr<LiveGuide> still_guide(double least_s);

}  // namespace perimap
