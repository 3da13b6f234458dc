// How the distances between a surface and a model err, and err together.
#pragma once

#include <Eigen/Core>

#include "core/registration/model_fit.hpp"

namespace perimap {

// Points of the surface that met the model, N columns each.
struct MetPoints {
  Eigen::Matrix3Xd positions_I_mm;   // of the surface
  Eigen::Matrix3Xd places_I_mm;      // nearest ones of the model
  Eigen::Matrix3Xd normals_I;        // of the model there
  Eigen::VectorXd residuals_mm;      // distance along it
  Eigen::Matrix3Xd spreads;          // S n, with S the symmetric root of the point's covariance
  Eigen::VectorXd rates_mm_per_rad;  // along the normal

  [[nodiscard]] Eigen::Index size() const noexcept { return residuals_mm.size(); }
};

// N x N, mm^2.
[[nodiscard]] Eigen::MatrixXd residual_covariance(const MetPoints& points, const ModelErrors& errors);

}  // namespace perimap
