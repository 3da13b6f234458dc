// The surface with a preoperative model of the organ for its topology: the model's vertices, set in motion by the
// features.
//
// A vertex lies at m in W at the phase phi_0 at which the model was imaged, and moves as the field of motion does at
// its mean place (MotionField). With the harmonics h(phi; p) of the field,
//
//   p = m - h(phi_0; p),   p(phi) = p + h(phi; p),
//
// and p is found by repetition. How far the model's shape and registration are off goes into the covariance of p, and
// so does what is not known of h(phi_0; p). Where the features tell how deep the surface lies (DepthField), the vertex
// is moved along its normal by an iterated Kalman filter with that depth for its measurement: on the surface that is
// seen, along it as the registration has it. docs/design/surface.md.
#pragma once

#include <memory>
#include <vector>

#include "core/geometry/triangle_mesh.hpp"
#include "core/surface/model_motion.hpp"
#include "core/surface/periodic_surface.hpp"
#include "core/surface/surface_mesh.hpp"

namespace perimap {

struct OrganModel {
  TriangleMesh mesh_W;              // mm, at `phase_rad`
  std::vector<Vector3d> normals_W;  // vertex_normals() of it
  double phase_rad = 0.0;
  std::shared_ptr<const ModelMotion> motion;  // of these vertices; null: the model is of one phase
  double shape_mm = 1.0;                      // its error along its normals, standard deviation
  double registration_mm = 1.0;               // that of its place at the organ, in each direction
};

// All vertices of the model in its order, and those triangles whose corners are supported: features are about it, in
// space and as the camera sees it; it faces the camera; the surface that is seen does not contradict it; and its
// deviation along its normal is within the surface's bound. All others are kUncertain: they lie where the model has
// them at its phase, move as it does by itself as far as features have that motion (PeriodicSurface::unseen_motion; the
// surface is fitted with the model's), and may move beside that by as much as features do anywhere. The result is a
// function of the arguments alone.
[[nodiscard]] SurfaceMesh mesh_of(const PeriodicSurface& surface, const OrganModel& model);

}  // namespace perimap
