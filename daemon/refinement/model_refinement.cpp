#include "daemon/refinement/model_refinement.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/registration/mesh_check.hpp"
#include "drivers/calibration/registration_file.hpp"
#include "drivers/mesh_file/mesh_file.hpp"

namespace perimap {
namespace {

Matrix6d covariance_of(double deviation_mm, double deviation_rad) {
  // RMS of norms in three dimensions: each axis has a third of the square.
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << Vector3d::Constant(deviation_rad * deviation_rad / 3.0),
      Vector3d::Constant(deviation_mm * deviation_mm / 3.0);
  return covariance;
}

Expected<RigidEstimate> start_of(const RefinementSource& source, const Vector3d& middle_of_model_I) {
  RigidEstimate start;
  start.covariance = covariance_of(source.start_mm, source.start_rad);
  start.middle_I = middle_of_model_I;
  if (source.registration.empty()) return start;
  const auto registration = read_registration(source.registration);
  if (!registration) return tl::unexpected(registration.error());
  start.X_IW = registration->X_IW;
  if (registration->covariance) {
    start.covariance = *registration->covariance;
    start.middle_I = registration->middle_I;
  }
  return start;
}

Vector3d middle_of(const TriangleMesh& mesh) {
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& p : mesh.vertices) middle += p / static_cast<double>(mesh.vertices.size());
  return middle;
}

// Errors of the model begin with its file's name.
tl::unexpected<Error> wrong_model(const RefinementSource& source, const Error& error) {
  return fail(fmt::format("{}: {}", source.model, error.message));
}

}  // namespace

Expected<Refinement> refine_registration(const RefinementSource& source) {
  auto mesh = read_mesh(source.model, source.unit_mm);
  if (!mesh) return tl::unexpected(mesh.error());
  const auto checked = check_mesh(*std::move(mesh));
  if (!checked) return wrong_model(source, checked.error());
  const auto start = start_of(source, middle_of(checked->mesh));
  if (!start) return tl::unexpected(start.error());
  auto surface = read_published_surface(source.recording, source.cycle_share);
  if (!surface) return tl::unexpected(surface.error());
  ModelErrors errors;
  errors.shape_mm = source.shape_mm;
  errors.shape_length_mm = source.shape_length_mm;
  errors.phase_rad = 2.0 * std::numbers::pi * source.cycle_share_deviation;
  errors.surface_length_mm = surface->feature_spacing_mm;
  errors.common_share = surface->common_share;
  auto fit = fit_model(checked->mesh, surface->points, *start, errors);
  if (!fit) return wrong_model(source, fit.error());
  Refinement refinement{*std::move(surface), *std::move(fit), checked->doubts, std::nullopt, checked->border_edges};
  if (!source.compare.empty()) {
    const auto other = read_registration(source.compare);
    if (!other) return tl::unexpected(other.error());
    refinement.difference =
        difference_at(refinement.fit.estimate, other->X_IW, refinement.surface.points.positions_W_mm);
  }
  return refinement;
}

}  // namespace perimap
