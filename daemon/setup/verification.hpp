// Whether a set-up is right, before a session: `perimap verify`. A board that stays where it is is looked at from many
// sides, and a pointer may touch a point of it.
#pragma once

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/dwells.hpp"
#include "core/calibration/timed_poses.hpp"
#include "core/error/expected.hpp"
#include "daemon/pages/svg_plot.hpp"

namespace perimap {

// What is on trial.
struct SetupOnTrial {
  Pose X_SC;
  double time_offset_s = 0.0;  // added to the tracker's times to get the camera's
};

struct TouchOnTrial {
  std::vector<TimedPoint> tip_W;          // where the pointer's tip was, on the tracker's clock
  Vector3d touched_B = Vector3d::Zero();  // the point of the board that it touched
  double tip_deviation_mm = 0.0;          // of the tip in the pointer's frame, of the 3-D norm
};

// The touched point: where the pointer has it less where the camera has it, in W.
struct VerifiedTouch {
  Vector3d error_W_mm = Vector3d::Zero();
  double error_mm = 0.0;
  double error_mm_deviation = 0.0;
  double held_s = 0.0;
};

struct Verification {
  double bound_mm = 0.0;
  std::size_t views = 0;
  std::size_t views_left_out = 0;  // a few that are far off, one by one
  double watched_s = 0.0;
  Vector3d turned_deg = Vector3d::Zero();  // the scope, standard deviations about three axes
  // Where the board's middle is in W by the views, about its mean.
  double scatter_mm = 0.0;  // RMS of single views, 3-D: all errors, the tracker's noise too
  // What is left of it when the tracker's noise that is new in each pose is taken off, by its poses' own second
  // differences: errors that stay, and those that go with the scope's pose or speed.
  double error_mm = 0.0;
  double error_mm_deviation = 0.0;
  // How far off the time offset is, to be added to it. Within the bound means: at the speed of a scope that is moved
  // briskly, whatever the speed it was swung with here.
  static constexpr double kBrisk_mm_per_s = 200.0;
  double clock_error_ms = 0.0;
  double clock_error_ms_deviation = 0.0;
  // How far elsewhere in the sensor the camera could be and the board would still pass: views from all sides show only
  // what turns with the scope, and least of it along the direction that the swing carries about least. A touched point
  // shows all of it. 0 where the board did not pass.
  double unseen_mm = 0.0;
  std::optional<VerifiedTouch> touch;
  std::vector<double> times_s;    // of each view, since the first
  std::vector<double> errors_mm;  // of each view

  [[nodiscard]] bool board_passed() const { return error_mm + 2.0 * error_mm_deviation <= bound_mm; }
  [[nodiscard]] bool clock_passed() const {
    return (std::abs(clock_error_ms) + 2.0 * clock_error_ms_deviation) * 1e-3 * kBrisk_mm_per_s <= bound_mm;
  }
  [[nodiscard]] bool touch_passed() const {
    return !touch || touch->error_mm + 2.0 * touch->error_mm_deviation <= bound_mm;
  }
  [[nodiscard]] bool passed() const { return board_passed() && clock_passed() && touch_passed(); }
};

// X_BC by the camera and X_WS by the tracker, each on its own clock. `middle_B`: of the board. Fails, and says what is
// missing, when they hardly overlap, the scope hardly moved, or the pointer touched nothing near the board's point.
[[nodiscard]] Expected<Verification> verify_setup(const std::vector<TimedPose>& camera,
                                                  const std::vector<TimedPose>& sensor, const Vector3d& middle_B,
                                                  const SetupOnTrial& setup, const std::optional<TouchOnTrial>& touch,
                                                  double bound_mm);

[[nodiscard]] std::string text_of(const Verification& result);
[[nodiscard]] nlohmann::json json_of(const Verification& result);
// Of one that did not pass: what to do.
[[nodiscard]] std::string advice_of(const Verification& result);
[[nodiscard]] std::vector<Plot> plots_of(const Verification& result);

}  // namespace perimap
