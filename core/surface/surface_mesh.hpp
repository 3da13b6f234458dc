// The moving surface as a mesh: what is handed over, and evaluated at any instant.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "core/periodic/basis.hpp"
#include "core/surface/motion_field.hpp"
#include "core/surface/periodic_surface.hpp"

namespace perimap {

// Vertices with the harmonics of their motion, and what is known of them. In it is what features are near to: what they
// support, and beside it, in no triangle, what is too uncertain.
struct SurfaceMesh {
  BasisLayout layout;
  Eigen::MatrixXd coefficients_W_mm;                    // 3 V x basis, as PredictedPlaces
  Matrix6Xd covariances_W_mm2;                          // 6 x V, likewise
  std::vector<Support> support;                         // V: kSupported or kUncertain
  std::vector<std::array<std::uint32_t, 3>> triangles;  // counter-clockwise as the mean camera sees them

  [[nodiscard]] Eigen::Index vertices() const noexcept { return covariances_W_mm2.cols(); }
};

// About `vertices` places on a triangular lattice of the chart, over all that the features of `surface` support; fewer
// are left. A triangle is there where its corners are supported, and where it is not seen edge-on from the mean camera,
// as one is that spans from an instrument or a fold to what lies behind it.
[[nodiscard]] SurfaceMesh mesh_of(const PeriodicSurface& surface, std::size_t vertices);

// Positions of a mesh at an instant, with their deviations. Memory is taken at construction; evaluating allocates
// nothing, and takes time in proportion to the vertices.
class EvaluatedSurface {
 public:
  explicit EvaluatedSurface(const SurfaceMesh& mesh);

  // The mesh must be that of the construction or one of its size. `rate`: db/dphi (basis_rate), `phase_deviation_rad`
  // the deviation of phi.
  void evaluate(const SurfaceMesh& mesh, const Basis& b, const Basis& rate, double phase_deviation_rad) noexcept;

  // mm, frame W; 3 x V.
  [[nodiscard]] Eigen::Map<const Eigen::Matrix3Xd> positions() const noexcept {
    return {positions_.data(), 3, positions_.size() / 3};
  }
  // dp/dphi, mm/rad; 3 x V.
  [[nodiscard]] Eigen::Map<const Eigen::Matrix3Xd> rates() const noexcept {
    return {rates_.data(), 3, rates_.size() / 3};
  }
  // Not below the position's deviation in any direction, the phase's share counted; mm, V.
  [[nodiscard]] const Eigen::VectorXd& deviations() const noexcept { return deviations_; }

 private:
  Eigen::VectorXd largest_mm2_;  // V, largest eigenvalue of each covariance
  Eigen::VectorXd positions_;    // 3 V
  Eigen::VectorXd rates_;        // 3 V
  Eigen::VectorXd deviations_;
};

}  // namespace perimap
