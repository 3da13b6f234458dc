// By how much all predictions of a frame are off together.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "core/geometry/pose.hpp"
#include "core/pipeline/feature_slot.hpp"

namespace perimap {

// Of a frame's matches from where the map and the tracker's pose have them. A wrong position or direction of the camera
// shifts them about alike, a roll or a wrong distance by what grows with the place: a linear function of it.
struct CommonShift {
  static constexpr double kUnit_px = 100.0;

  bool known = false;
  Vector2d centre_px = Vector2d::Zero();                                           // of the scouts
  Eigen::Matrix<double, 3, 2> coefficients = Eigen::Matrix<double, 3, 2>::Zero();  // px, of the terms
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();  // of the coefficients, in squares of the deviation
  double deviation_px = 0.0;                         // of a feature's own shift from the function, per axis

  [[nodiscard]] Eigen::Vector3d terms(const Vector2d& px) const noexcept {
    return {1.0, (px.x() - centre_px.x()) / kUnit_px, (px.y() - centre_px.y()) / kUnit_px};
  }
  // At the place where a feature is predicted.
  [[nodiscard]] Vector2d at(const Vector2d& px) const noexcept { return coefficients.transpose() * terms(px); }
  // Per axis, px^2; grows away from the scouts.
  [[nodiscard]] double variance_at(const Vector2d& px) const noexcept {
    const Eigen::Vector3d t = terms(px);
    return deviation_px * deviation_px * (1.0 + t.dot(spread * t));
  }
};

// A noisy pose moves all predictions of a frame alike, and far more than the map is in doubt about one of them. So a
// few converged features, the scouts, are searched for as widely as the pose is uncertain, and the others near where
// those say.

// Before any is searched for: marks the frame's scouts, spread over the slots, and tells whether there are any: not
// where there are too few features to be worth it, or the pose was sure in the last frame. No heap.
[[nodiscard]] bool choose_scouts(std::span<FeatureSlot> slots, std::uint64_t frame_index) noexcept;

// Once they have been searched for. Unknown when too few were found, when they do not agree, or when the predictions
// are so sure that there is nothing to gain.
[[nodiscard]] CommonShift shift_of_scouts(std::span<const FeatureSlot> slots) noexcept;

}  // namespace perimap
