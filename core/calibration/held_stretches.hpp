// When an angled scope was held at one turn and one zoom, and at which, in a recording in which it is turned and zoomed
// in between.
#pragma once

#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

// How the scope was turned at a moment, as an orientation: of the notch about the picture's axis, or of a second sensor
// in the frame of the first; and how it was zoomed, by the field stop's radius in the picture.
struct TimedTurn {
  double t_s = 0.0;
  Matrix3d R = Matrix3d::Identity();
  double radius_px = 0.0;  // 0: zoom is not told of
};

struct HeldStretch {
  double from_s = 0.0;
  double to_s = 0.0;
  Matrix3d R = Matrix3d::Identity();  // mean of its readings
  double radius_px = 0.0;             // likewise
};

// A stretch that is shorter tells no set-up.
inline constexpr double kLeastHeld_s = 11.5;

// The field stop's radius at the zoom at which the scope is turned: of the first stretch that is long enough; while
// none is, of the last one. 0: there is no stretch, or zoom is not told of.
[[nodiscard]] double radius_of_turns_px(const std::vector<HeldStretch>& stretches);

// The orientation of a notch that is seen at this angle.
[[nodiscard]] Matrix3d orientation_of_notch(double notch_rad);

// Within three degrees of each other: of one turn, as far as a reading tells.
[[nodiscard]] bool is_same_turn(const Matrix3d& a, const Matrix3d& b);

// Radians from one orientation to the other.
[[nodiscard]] double angle_between(const Matrix3d& a, const Matrix3d& b);

// Follows readings in the order of their times. Those within three degrees of a stretch's mean, and of its zoom, belong
// to it. One or two in a row that do not may be misread; three end it, also where the scope comes back to the same
// turn. Three in a row that are alike begin the next stretch.
class HeldStretches {
 public:
  void add(const TimedTurn& reading);

  // Whether the last reading belongs to the last stretch; else the scope is being turned or zoomed, or was misread.
  [[nodiscard]] bool is_held() const { return held_; }
  // All so far, in the order of their times; the last one may go on.
  [[nodiscard]] const std::vector<HeldStretch>& stretches() const { return stretches_; }

 private:
  void begin();

  std::vector<HeldStretch> stretches_;
  double readings_ = 0.0;          // of the last stretch
  bool open_ = false;              // it may go on
  std::vector<TimedTurn> others_;  // the last ones since those that belonged to it
  bool held_ = false;
};

}  // namespace perimap
