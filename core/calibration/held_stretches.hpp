// When an angled scope was held at one turn, and at which, in a recording in which it is turned in between.
#pragma once

#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

// How the scope was turned at a moment, as an orientation: of the notch about the picture's axis, or of a second sensor
// in the frame of the first.
struct TimedTurn {
  double t_s = 0.0;
  Matrix3d R = Matrix3d::Identity();
};

struct HeldStretch {
  double from_s = 0.0;
  double to_s = 0.0;
  Matrix3d R = Matrix3d::Identity();  // mean of its readings
};

// The orientation of a notch that is seen at this angle.
[[nodiscard]] Matrix3d orientation_of_notch(double notch_rad);

// Within three degrees of each other: of one turn, as far as a reading tells.
[[nodiscard]] bool is_same_turn(const Matrix3d& a, const Matrix3d& b);

// Radians from one orientation to the other.
[[nodiscard]] double angle_between(const Matrix3d& a, const Matrix3d& b);

// Follows readings in the order of their times. Those within three degrees of a stretch's mean belong to it. One or two
// in a row that do not may be misread; three end it, also where the scope comes back to the same turn. Three in a row
// that are alike begin the next stretch.
class HeldStretches {
 public:
  void add(const TimedTurn& reading);

  // Whether the last reading belongs to the last stretch; else the scope is being turned, or was misread.
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
