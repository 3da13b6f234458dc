// The path of a scope held by a hand: slow sweeps for parallax, looking near one point, with a hand's tremor.
#pragma once

#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Smooth in time; a function of the seed alone.
class ScopePath {
 public:
  // Sweeps about `rest_W`, looking near `target_W`; the image's upper side points along `up_W` on the whole. `sweep`
  // scales how far from the target the scope looks: at 5, what lies off the target leaves the view and comes back.
  ScopePath(std::uint64_t seed, const Vector3d& rest_W, const Vector3d& target_W, const Vector3d& up_W,
            double sweep = 1.0) noexcept;

  // Pose of the camera, time since the path's start.
  [[nodiscard]] Pose X_WC(Duration since_start) const noexcept;
  // Where it rests, looking at the target.
  [[nodiscard]] const Pose& X_WR() const noexcept { return X_WR_; }

 private:
  // Sum of two sinusoids whose periods have no common multiple within any recording.
  struct Sway {
    double amplitude_1 = 0.0, frequency_1_hz = 0.0, phase_1_rad = 0.0;
    double amplitude_2 = 0.0, frequency_2_hz = 0.0, phase_2_rad = 0.0;
    [[nodiscard]] double at(double t_s) const noexcept;
  };

  Pose X_WR_;                 // rest pose
  double distance_mm_ = 0.0;  // from rest to target
  Sway position_mm_[3];       // right, down, forward of the rest pose
  Sway target_mm_[2];         // of the point looked at, right and down
  Sway roll_rad_;
  Sway tremor_mm_[3];
  Sway tremor_rad_[3];
};

}  // namespace perimap
