// CameraModel in the form that the bank's kernels need.
#pragma once

#include "core/geometry/camera_model.hpp"

namespace perimap {

template <class Real>
struct PinholeLens {
  Real fx, fy, cx, cy, k1, k2, p1, p2, k3;
  // Least squared radius, in the undistorted normalised image, where the distorted radius stops growing although it
  // grows again further out; infinite where there is none. What lies beyond is folded back, whatever the sign there.
  Real turn_r2;
};

template <class Real>
[[nodiscard]] PinholeLens<Real> pinhole_lens(const CameraModel& camera) noexcept;

extern template PinholeLens<double> pinhole_lens(const CameraModel&) noexcept;
extern template PinholeLens<float> pinhole_lens(const CameraModel&) noexcept;

}  // namespace perimap
