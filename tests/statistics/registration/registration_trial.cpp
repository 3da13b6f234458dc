#include "registration_trial.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/registration/surface_points.hpp"
#include "core/surface/periodic_surface.hpp"
#include "core/surface/surface_mesh.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/second_heart.hpp"

namespace perimap::test {
namespace {

enum Stream : std::uint64_t { kModel = 3 };

}  // namespace

RegistrationTrial registration_trial(const HeartMesh& heart, const TrialSettings& settings) {
  const CounterNoise noise(settings.seed, kModel);
  const HeartPatch patch = patch_of(heart, settings.seen);
  const Vector3d common_W =
      settings.seen.common_mm / std::sqrt(3.0) * Vector3d(noise.normal(10), noise.normal(11), noise.normal(12));
  std::vector<SurfaceEvidence> evidence;
  for (const PlaceHarmonics& c : features_of(heart, patch, settings.seen, settings.seed)) {
    const auto id = static_cast<std::uint32_t>(evidence.size() + 1);
    evidence.push_back(evidence_of(c, id, settings.seen, settings.seed, common_W));
  }
  const BasisLayout layout{static_cast<int>(heart.harmonics), 0};
  const auto surface = PeriodicSurface::fit(layout, evidence, patch.camera_W);
  if (!surface) throw std::runtime_error(surface.error().message);
  const SurfaceMesh mesh = mesh_of(*surface, 1000);

  RegistrationTrial trial;
  PreoperativeSettings model = settings.model;
  model.seed = noise.bits(0);
  model.phase_rad = noise.uniform(1, 0.0, 2.0 * std::numbers::pi);
  trial.surface = points_at(mesh, model.phase_rad);
  trial.errors.surface_length_mm = feature_spacing_mm(mesh, surface->features());
  trial.errors.common_share = common_share_of(surface->agreement().nees);
  trial.model = preoperative_model(heart, model);
  trial.start.X_IW = trial.model.start_X_IW;
  trial.start.middle_I = trial.model.middle_I;
  trial.start.covariance.diagonal() << Vector3d::Constant(model.off_rad * model.off_rad / 3.0),
      Vector3d::Constant(model.off_mm * model.off_mm / 3.0);
  return trial;
}

TriangleMesh another_heart(const RegistrationTrial& trial, std::uint64_t seed) {
  const HeartMesh heart = second_heart(seed);
  const CounterNoise noise(seed, kModel);
  const Matrix3d R = so3_exp(Vector3d(noise.normal(20), noise.normal(21), noise.normal(22)));
  TriangleMesh mesh = surface_at(heart, 0.0);
  for (Vector3d& vertex : mesh.vertices) vertex = R * vertex + trial.model.middle_I;
  // Where the scope sees it, it touches the surface that is there: a registration by eye does that much.
  const Vector3d axis_I = trial.model.true_X_IW.R * towards_scope();
  const Vector3d place_I = trial.model.true_X_IW * Vector3d(trial.surface.positions_W_mm.rowwise().mean());
  double highest = -1e9;
  for (const Vector3d& vertex : mesh.vertices) {
    const Vector3d d = vertex - place_I;
    if ((d - d.dot(axis_I) * axis_I).norm() < 10.0) highest = std::max(highest, d.dot(axis_I));
  }
  for (Vector3d& vertex : mesh.vertices) vertex -= highest * axis_I;
  return mesh;
}

TriangleMesh mirrored(const RegistrationTrial& trial, std::uint64_t seed) {
  const CounterNoise noise(seed, kModel);
  // Left and right in the scope's view, so that what it sees stays in place.
  const Vector3d axis_I = trial.model.true_X_IW.R * towards_scope();
  const Vector3d u = axis_I.unitOrthogonal();
  const double angle = noise.uniform(30, 0.0, 2.0 * std::numbers::pi);
  const Vector3d across = std::cos(angle) * u + std::sin(angle) * axis_I.cross(u);
  const Vector3d place_I = trial.model.true_X_IW * Vector3d(trial.surface.positions_W_mm.rowwise().mean());
  TriangleMesh mesh = trial.model.mesh_I;
  for (Vector3d& vertex : mesh.vertices) vertex -= 2.0 * (vertex - place_I).dot(across) * across;
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

}  // namespace perimap::test
