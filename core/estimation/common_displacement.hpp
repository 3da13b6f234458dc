// A shift and a turn that all features have in common against the map, over seconds: the organ has been moved, or the
// tracker errs by more than it is said to.
//
// A frame's matches tell the error s = [theta, delta_c] of its camera pose (see shared_pose.hpp). Were the tracker's
// noise all that there is, its mean over frames would go to zero. A surface that turns by omega about a pivot c_0 and
// moves by v, d = [omega, v] in frame W, makes
//
//   s = T d + e,   T = [ R_CW          0 ]      e ~ N(0, Sigma + Lambda^-1)
//                      [ [c - c_0]x   -I ]
//
// where Sigma is the tracker's covariance and Lambda what the frame's matches tell of s. So a frame adds
// T^T (Sigma + Lambda^-1)^-1 T to the information about a displacement that stays, and neither of the two need be
// invertible where the other is large. The mean over a window follows from the sums. Its covariance is that of white
// errors, times what errors that are alike from frame to frame make of it, plus what the map itself is off by.
//
// A step that stays is found by windows of several lengths, the generalised likelihood ratio of a mean that has changed
// (Willsky & Jones, IEEE Trans. Automatic Control 21, 1976) for a few ages of the change: short ones find what is large
// soon, long ones what is small.
//
// No heap, deterministic.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "core/estimation/measurement_model.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"

namespace perimap {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// What is known of a displacement d: g = W d where W is its information.
struct DisplacementEvidence {
  Vector6d g = Vector6d::Zero();
  Matrix6d W = Matrix6d::Zero();
};

// What a frame tells. `s` and its covariance `posterior` were estimated with the prior `searched`, which is as wide as
// what was looked for; `tracker` is the covariance of the tracker's own error of the same six, positive definite.
[[nodiscard]] DisplacementEvidence displacement_evidence(const Vector6d& s, const Matrix6d& posterior,
                                                         const Matrix6d& searched, const Matrix6d& tracker,
                                                         const Pose& X_WC, const Vector3d& pivot_W_mm) noexcept;

// Maps a point of the map to where it is when the surface is displaced.
[[nodiscard]] Pose displaced(const Vector6d& d, const Vector3d& pivot_W_mm) noexcept;

// The surface that is seen, as far as a displacement concerns it.
struct DisplacedSurface {
  Vector3d centre_mm = Vector3d::Zero();  // of the features that are seen, from the pivot
  double spread_mm = 20.0;                // their root mean square distance from it
  double map_variance_mm2 = 0.0;          // per axis, of what the whole map is off by
};

// How much a displacement is.
struct DisplacementSize {
  double size_mm = 0.0;       // root mean square over the surface that is seen
  double deviation_mm = 0.0;  // likewise of its error
  double chi2 = 0.0;          // of the hypothesis that there is none, 6 degrees of freedom
};

// Of d about the middle of the surface, whose covariance is without what the map is off by.
[[nodiscard]] DisplacementSize size_of(const Vector6d& d, const Matrix6d& covariance,
                                       const DisplacedSurface& surface) noexcept;

// What the map as a whole is off by, about the middle of the surface.
[[nodiscard]] Matrix6d map_covariance(const DisplacedSurface& surface) noexcept;

// Over one window.
struct MeanDisplacement : DisplacementSize {
  bool told = false;                           // false: too few frames; the rest means nothing
  Vector6d d = Vector6d::Zero();               // about the pivot
  Vector6d at_centre = Vector6d::Zero();       // the same about the middle of the surface that is seen
  Matrix6d covariance = Matrix6d::Identity();  // of that, without what the map is off by
};

class CommonDisplacement {
 public:
  static constexpr std::array<Duration, 5> kWindows{std::chrono::milliseconds(500), std::chrono::seconds(1),
                                                    std::chrono::seconds(2), std::chrono::seconds(4),
                                                    std::chrono::seconds(8)};
  // Readings between which a tracker's error is new.
  static constexpr Duration kEvery = std::chrono::milliseconds(60);

  // `error_correlation`: time in which the tracker's error falls to 1/e (Gauss-Markov); 0: it is new in each frame.
  explicit CommonDisplacement(Duration error_correlation) noexcept : error_correlation_(error_correlation) {}

  // In order of time; a frame too soon after the one before, or before it, is passed over.
  void add(Instant capture, const DisplacementEvidence& evidence) noexcept;
  void clear() noexcept { count_ = 0; }

  // Up to `now`, over as long as the window says.
  [[nodiscard]] MeanDisplacement mean(std::size_t window, Instant now, const DisplacedSurface& surface) const noexcept;

 private:
  static constexpr std::uint64_t kCapacity = 256;  // more than the longest window holds

  struct Entry {
    Instant capture;
    DisplacementEvidence evidence;
  };
  [[nodiscard]] const Entry& entry(std::uint64_t number) const noexcept { return entries_[number % kCapacity]; }

  Duration error_correlation_;
  std::array<Entry, kCapacity> entries_{};
  std::uint64_t count_ = 0;
};

}  // namespace perimap
