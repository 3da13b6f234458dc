// Whether one place of the surface is displaced from where the map has it, by what the features there have been off by
// over some moments: a dent, or an instrument that presses.
//
// Beside the pose that all matches of a frame agree on, a match of feature i leaves r = J_i d_i + e, e ~ N(0, R): the
// feature is off the map by d_i (mm, W). What frames tell of d_i is summed as its information
//
//   Lambda_i = sum J^T R^-1 J,   eta_i = sum J^T R^-1 r.
//
// The map itself is off by as much as it says, S_i, in all of these frames alike, so of the displacement alone tells
// A_i = (I + Lambda_i S_i)^-1:  A_i Lambda_i about it, and A_i eta_i. A place c that is displaced by v takes its
// neighbours along by a share that falls with their distance,
//
//   d_i = w_i v,   w_i = 1 - |p_i - c|^2 / radius^2,
//
// so that each adds w_i^2 A_i Lambda_i and w_i A_i eta_i. A single camera hardly sees what is pressed away from it; the
// features around are spread apart by it, or drawn together, and tell.
//
// No heap, deterministic.
#pragma once

#include <span>

#include "core/estimation/measurement_model.hpp"
#include "core/geometry/pose.hpp"

namespace perimap {

// What is known of a displacement.
struct OffMap {
  Matrix3d Lambda = Matrix3d::Zero();  // 1/mm^2
  Vector3d eta = Vector3d::Zero();     // 1/mm

  // A match with the residual r (px), J = d px / d p_W (px/mm) and the covariance R (px^2), by a weight from 0 to 1.
  void add(const Vector2d& r, const Matrix23d& J, const Matrix2d& R, double weight) noexcept;
  // What has been told is worth that share of what it was.
  void fade(double share) noexcept {
    Lambda *= share;
    eta *= share;
  }
};

// The same without what the map is off by: its covariance S (mm^2, W).
[[nodiscard]] OffMap beside_map(const OffMap& off, const Matrix3d& S) noexcept;

struct OffFeature {
  Vector3d p_W_mm = Vector3d::Zero();  // where the map has it
  OffMap off;                          // beside_map()
};

struct LocalDisplacement {
  Vector3d v_W_mm = Vector3d::Zero();
  double size_mm = 0.0;
  double chi2 = 0.0;          // of the hypothesis that there is none, 3 degrees of freedom
  double chi2_of_others = 0;  // the same without the feature that tells most
  int features = 0;           // within the radius
};

// About a place of the map.
[[nodiscard]] LocalDisplacement local_displacement(std::span<const OffFeature> features, const Vector3d& place_W_mm,
                                                   double radius_mm) noexcept;

}  // namespace perimap
