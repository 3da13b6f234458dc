// Whether the camera has lately been in more than one place: from one alone no image tells how far away anything is.
#pragma once

#include <algorithm>
#include <chrono>

#include "core/pipeline/pose_history.hpp"
#include "core/time/instant.hpp"

namespace perimap {

class Parallax {
 public:
  // The pose at a frame's capture, with the variances of the tracker alone.
  void add(const CameraPose& pose, Instant capture) noexcept {
    if (!pose.valid()) return;
    const double noise_mm2 =
        3 * pose.position_variance_mm2 + 2 * pose.rotation_variance_rad2 * pose.lever_W_mm.squaredNorm();
    const Vector3d& centre = pose.X_WC.t;
    if (!any_) {
      any_ = true;
      begun_ = last_ = capture;
      mean_mm_ = centre;
    }
    const double share = std::clamp(to_seconds(capture - last_) / to_seconds(kLately), 0.0, 1.0);
    last_ = capture;
    const Vector3d off = centre - mean_mm_;
    mean_mm_ += share * off;
    spread_mm2_ = (1 - share) * (spread_mm2_ + share * off.squaredNorm());
    noise_mm2_ += share * (noise_mm2 - noise_mm2_);
    ever_ = ever_ || spread();
  }

  // False too while it is not known yet: for some seconds of poses.
  [[nodiscard]] bool none() const noexcept { return any_ && last_ - begun_ >= kLately && !spread(); }
  // Whether it has been in more than one place since the first pose.
  [[nodiscard]] bool ever() const noexcept { return ever_; }

 private:
  static constexpr Duration kLately = std::chrono::seconds(5);

  [[nodiscard]] bool spread() const noexcept {
    constexpr double kLeast_mm = 1.5;  // root mean square about the mean place, beyond the tracker's noise
    return spread_mm2_ - noise_mm2_ >= kLeast_mm * kLeast_mm;
  }

  bool any_ = false;
  bool ever_ = false;
  Instant begun_, last_;
  Vector3d mean_mm_ = Vector3d::Zero();
  double spread_mm2_ = 0.0;
  double noise_mm2_ = 0.0;
};

}  // namespace perimap
