// A sheet of triangles that beats.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/phase/cardiac_clock.hpp"
#include "core/surface/surface_mesh.hpp"

namespace perimap::test {

// side x side vertices 5 mm apart about the z axis, nearly flat, at z = 0 in the mean; its front, where the camera is,
// looks along -z. It moves along z by 2 mm, a little differently at each place.
inline SurfaceMesh sheet(std::uint32_t side) {
  SurfaceMesh mesh;
  mesh.layout = {2, 0};
  const auto V = static_cast<Eigen::Index>(side * side);
  mesh.coefficients_W_mm = Eigen::MatrixXd::Zero(3 * V, mesh.layout.size());
  mesh.covariances_W_mm2 = Matrix6Xd::Zero(6, V);
  for (const int diagonal : {0, 3, 5}) mesh.covariances_W_mm2.row(diagonal).setConstant(0.01);
  mesh.support.assign(side * side, Support::kSupported);
  for (std::uint32_t row = 0; row < side; ++row) {
    for (std::uint32_t column = 0; column < side; ++column) {
      const Eigen::Index v = row * side + column;
      const double x = 5.0 * (column - 0.5 * (side - 1)), y = 5.0 * (row - 0.5 * (side - 1));
      mesh.coefficients_W_mm(3 * v, 0) = x;
      mesh.coefficients_W_mm(3 * v + 1, 0) = y;
      mesh.coefficients_W_mm(3 * v + 2, 0) = 0.002 * (x * x + y * y);
      mesh.coefficients_W_mm(3 * v + 2, 1) = 2.0 + 0.01 * x;
      mesh.coefficients_W_mm(3 * v + 2, 3) = 1.0 + 0.01 * y;
      if (row == 0 || column == 0) continue;
      const std::uint32_t d = row * side + column, c = d - 1, b = d - side, a = b - 1;
      mesh.triangles.push_back({a, c, d});
      mesh.triangles.push_back({a, d, b});
    }
  }
  return mesh;
}

// One beat a second.
inline PhaseEstimate phase_of(double phase_rad) {
  PhaseEstimate phase;
  phase.phase_rad = phase_rad;
  phase.rate_rad_per_s = 6.28;
  phase.state = PhaseState::kLocked;
  return phase;
}

}  // namespace perimap::test
