// Whether the camera has been in more than one place: from one alone no image tells how far away anything is.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

#include "core/pipeline/pose_history.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Of the camera's centre, by the variances of the tracker alone: the mean square of its 3-D error.
[[nodiscard]] inline double centre_noise_mm2(const CameraPose& pose) noexcept {
  return 3 * pose.position_variance_mm2 + 2 * pose.rotation_variance_rad2 * pose.lever_W_mm.squaredNorm();
}

// Root mean square about the mean place, beyond the tracker's noise, from which on places count as more than one.
inline constexpr double kLeastSpread_mm = 1.5;

// Lately.
class Parallax {
 public:
  // The pose at a frame's capture, with the variances of the tracker alone.
  void add(const CameraPose& pose, Instant capture) noexcept {
    if (!pose.valid()) return;
    const double noise_mm2 = centre_noise_mm2(pose);
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

  [[nodiscard]] bool spread() const noexcept { return spread_mm2_ - noise_mm2_ >= kLeastSpread_mm * kLeastSpread_mm; }

  bool any_ = false;
  bool ever_ = false;
  Instant begun_, last_;
  Vector3d mean_mm_ = Vector3d::Zero();
  double spread_mm2_ = 0.0;
  double noise_mm2_ = 0.0;
};

// In all the time in which one feature was measured: what has once been seen from aside stays as well known.
class SeenFromAside {
 public:
  SeenFromAside() = default;
  // Of a feature of which that is known.
  explicit SeenFromAside(bool known) noexcept : known_(known) {}

  // The pose at a measurement.
  void add(const CameraPose& pose) noexcept {
    if (known_ || !pose.valid()) return;
    const Vector3d off = pose.X_WC.t - mean_mm_;
    const double share = 1.0 / static_cast<double>(++poses_);
    mean_mm_ += share * off;
    spread_mm2_ = (1 - share) * (spread_mm2_ + share * off.squaredNorm());
    noise_mm2_ += share * (centre_noise_mm2(pose) - noise_mm2_);
    // The noise is known to a part of itself alone.
    constexpr std::uint32_t kEnoughPoses = 30;
    constexpr double kOfNoise = 0.5;
    const double least_mm2 = std::max(kLeastSpread_mm * kLeastSpread_mm, kOfNoise * noise_mm2_);
    known_ = poses_ >= kEnoughPoses && spread_mm2_ - noise_mm2_ >= least_mm2;
  }
  [[nodiscard]] bool known() const noexcept { return known_; }

 private:
  Vector3d mean_mm_ = Vector3d::Zero();
  double spread_mm2_ = 0.0;
  double noise_mm2_ = 0.0;
  std::uint32_t poses_ = 0;
  bool known_ = false;
};

}  // namespace perimap
