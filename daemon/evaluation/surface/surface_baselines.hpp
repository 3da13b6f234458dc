// What one would interpolate features with that have no covariance: beside the surface, to see what that is worth.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/geometry/pose.hpp"

namespace perimap {

// N x V: how much each of N features counts at each of V places. A column of zeros: the place is not within them.

// Linear in the triangles of Delaunay's triangulation.
[[nodiscard]] Eigen::MatrixXd barycentric_weights(const std::vector<Vector2d>& features,
                                                  const std::vector<Vector2d>& places);

// The thin plate that goes through all features (Duchon 1977): r^2 log r and a free plane.
[[nodiscard]] Eigen::MatrixXd thin_plate_weights(const std::vector<Vector2d>& features,
                                                 const std::vector<Vector2d>& places);

}  // namespace perimap
