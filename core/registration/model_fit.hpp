// A preoperative model fitted to a surface that was measured: the rigid registration that a start has nearly, refined
// point to plane, with the covariance that correlated errors leave it.
//
// The pose is that of least squares, first with each residual by its own variance and then under their whole covariance
// (generalised least squares), with the start as prior. A residual is the distance of a point of the surface from the
// model, along the model's normal (point to plane: Chen & Medioni, Image and Vision Computing 10(3), 1992). Its
// covariance has
//   - the surface's own, which neighbours share as far as the features that it rests on are apart, and all share what
//     the map has in common;
//   - the model's error of shape, as it is declared: Matern 3/2 over the model;
//   - what the model's own phase is not known by: one number for all.
// What no covariance explains (an instrument that was taken for tissue) has less weight. Equations:
// docs/design/registration.md.
//
// It allocates, and takes tenths of a second.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/geometry/triangle_mesh.hpp"

namespace perimap {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// N points of the surface, at the model's phase, in the frame W.
struct SurfacePoints {
  Eigen::Matrix3Xd positions_W_mm;
  Eigen::Matrix3Xd normals_W;                                  // unit, towards where the camera was
  Eigen::Matrix3Xd rates_W_mm_per_rad;                         // by the cardiac phase
  Eigen::Matrix<double, 6, Eigen::Dynamic> covariances_W_mm2;  // xx xy xz yy yz zz

  [[nodiscard]] Eigen::Index size() const noexcept { return positions_W_mm.cols(); }
};

// What is not the registration's fault.
struct ModelErrors {
  double shape_mm = 1.0;            // of the model along its normal, standard deviation
  double shape_length_mm = 30.0;    // over which that changes
  double phase_rad = 0.0;           // deviation of the model's phase
  double surface_length_mm = 10.0;  // over which the surface's own error changes: about how far its features are apart
  double common_share = 0.0;        // of its variance, 0 to 1: what all of it has in common
};

// X_IW maps the frame W to the model's, I. The covariance is that of (rotation vector, translation) in I about
// `middle_I`, rad and mm.
struct RigidEstimate {
  Pose X_IW;
  Matrix6d covariance = Matrix6d::Zero();
  Vector3d middle_I = Vector3d::Zero();
};

struct ModelFit {
  RigidEstimate estimate;          // about the middle of the points that met the model
  std::size_t points = 0;          // that met the model
  std::size_t beyond_edge = 0;     // whose nearest place is the model's border
  std::size_t turned_away = 0;     // whose nearest place faces the other side
  double start_residual_mm = 0.0;  // RMS of the distances
  double residual_mm = 0.0;
  double expected_residual_mm = 0.0;  // by the errors that are declared
  double moved_mm = 0.0;              // RMS over the points, from the start
  double moved_rad = 0.0;
  double organ_deviation_mm = 0.0;  // RMS over the points, of the registration alone
  // Directions of (rotation, translation) that the surface tells so little of that what is known of them is the
  // start's: 0 to 6.
  int told_by_start = 0;
  std::vector<std::string> doubts;  // one line each; none: the model fits
};

// `model`: as check_mesh() gives it. Refused, with what and where: fewer than 30 points that meet the model, or most of
// them beyond its edges; a model that faces the other way there; residuals that its declared errors do not explain.
// What is less than certain, but not refused, is in `doubts`.
[[nodiscard]] Expected<ModelFit> fit_model(const TriangleMesh& model, const SurfacePoints& surface,
                                           const RigidEstimate& start, const ModelErrors& errors);

// Where a second registration has the organ, beside a first one.
struct RegistrationDifference {
  double rms_mm = 0.0;  // over the points
  double largest_mm = 0.0;
  double nees = 0.0;  // the difference's square by the first one's covariance, over 6: 1 is consistent
};
[[nodiscard]] RegistrationDifference difference_at(const RigidEstimate& first, const Pose& second_X_IW,
                                                   const Eigen::Matrix3Xd& positions_W_mm);

}  // namespace perimap
