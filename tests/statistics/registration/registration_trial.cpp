#include "registration_trial.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "core/registration/surface_points.hpp"
#include "core/surface/periodic_surface.hpp"
#include "core/surface/surface_mesh.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/second_heart.hpp"

namespace perimap::test {
namespace {

constexpr double kScope_mm = 120.0;  // from the surface
constexpr double kApart_mm = 4.0;    // features
constexpr double kFaced = 0.5;       // cosine of what is followed

enum Stream : std::uint64_t { kPlace = 1, kError, kModel };

Vector3d towards_scope() { return Vector3d(0.45, -0.80, -0.38).normalized(); }

using Coefficients = Eigen::Matrix3Xd;  // rows x, y, z; columns of the basis

Coefficients coefficients_of(const HeartMesh& heart, std::uint32_t vertex) {
  const auto n = static_cast<Eigen::Index>(heart.coefficients_per_axis());
  return Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>>(
      heart.coefficients_mm.data() + 3 * n * vertex, 3, n);
}

struct Patch {
  Vector3d target_W, camera_W;
  std::vector<std::size_t> triangles;  // first index of each that is seen
};

Patch patch_of(const HeartMesh& heart, const TrialSettings& settings) {
  const Vector3d axis = towards_scope();
  std::vector<Vector3d> p(heart.vertex_count);
  vertex_positions(heart, fourier_basis(0.0, heart.harmonics), p);
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& q : p) middle += q / static_cast<double>(p.size());
  Patch patch;
  double highest = -1e9;
  for (const Vector3d& q : p) {
    const Vector3d d = q - middle;
    if ((d - d.dot(axis) * axis).norm() < 10.0 && d.dot(axis) > highest) {
      highest = d.dot(axis);
      patch.target_W = q;
    }
  }
  patch.camera_W = patch.target_W + kScope_mm * axis;
  const Vector3d aside = axis.unitOrthogonal();
  for (std::size_t t = 0; t < heart.triangles.size(); t += 3) {
    const Vector3d &a = p[heart.triangles[t]], &b = p[heart.triangles[t + 1]], &c = p[heart.triangles[t + 2]];
    const Vector3d normal = (b - a).cross(c - a).normalized();
    const Vector3d d = (a + b + c) / 3.0 - patch.target_W;
    const Vector3d ray = (patch.camera_W - (a + b + c) / 3.0).normalized();
    const bool within = (d - d.dot(axis) * axis).norm() < settings.patch_mm && d.dot(axis) > -60.0;
    const bool beside = settings.aside_mm <= 0.0 || d.dot(aside) > settings.aside_mm;
    if (within && beside && normal.dot(ray) > kFaced) patch.triangles.push_back(t);
  }
  return patch;
}

std::vector<Coefficients> features_of(const HeartMesh& heart, const Patch& patch, const TrialSettings& settings) {
  const CounterNoise noise(settings.seed, kPlace);
  std::vector<Coefficients> features;
  for (std::uint64_t draw = 0; features.size() < settings.features && draw < 200'000; ++draw) {
    const std::size_t t = patch.triangles[noise.bits(3 * draw) % patch.triangles.size()];
    double u = noise.uniform(3 * draw + 1), v = noise.uniform(3 * draw + 2);
    if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
    const Coefficients c = (1.0 - u - v) * coefficients_of(heart, heart.triangles[t]) +
                           u * coefficients_of(heart, heart.triangles[t + 1]) +
                           v * coefficients_of(heart, heart.triangles[t + 2]);
    const bool near = std::any_of(features.begin(), features.end(), [&](const Coefficients& other) {
      return (other.col(0) - c.col(0)).norm() < kApart_mm;
    });
    if (!near) features.push_back(c);
  }
  return features;
}

SurfaceEvidence evidence_of(const Coefficients& truth, std::uint32_t id, const TrialSettings& settings,
                            const Vector3d& common_W) {
  const CounterNoise noise(settings.seed, 1000 + id);
  const Vector3d axis = towards_scope();
  const double own = settings.feature_mm;
  // The symmetric root of sigma^2 (I + 3 a a^T).
  const Matrix3d root = own * (Matrix3d::Identity() + axis * axis.transpose());
  SurfaceEvidence evidence;
  evidence.id = id;
  const double common_mm2 = settings.common_mm * settings.common_mm / 3.0;
  evidence.mean_mm2 = root * root + common_mm2 * Matrix3d::Identity();
  evidence.bands_mm2.fill(0.25 * root * root);
  Coefficients c = truth;
  for (Eigen::Index j = 0; j < c.cols(); ++j) {
    const auto at = static_cast<std::uint64_t>(3 * j);
    const Vector3d drawn(noise.normal(at), noise.normal(at + 1), noise.normal(at + 2));
    c.col(j) += (j == 0 ? 1.0 : 0.5) * root * drawn;
  }
  c.col(0) += common_W;
  evidence.x.resize(3 * c.cols());
  for (Eigen::Index axis_of = 0; axis_of < 3; ++axis_of) {
    evidence.x.segment(axis_of * c.cols(), c.cols()) = c.row(axis_of).transpose();
  }
  return evidence;
}

}  // namespace

RegistrationTrial registration_trial(const HeartMesh& heart, const TrialSettings& settings) {
  const CounterNoise noise(settings.seed, kModel);
  const Patch patch = patch_of(heart, settings);
  const Vector3d common_W =
      settings.common_mm / std::sqrt(3.0) * Vector3d(noise.normal(10), noise.normal(11), noise.normal(12));
  std::vector<SurfaceEvidence> evidence;
  for (const Coefficients& c : features_of(heart, patch, settings)) {
    evidence.push_back(evidence_of(c, static_cast<std::uint32_t>(evidence.size() + 1), settings, common_W));
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
  TriangleMesh mesh;
  mesh.vertices.resize(heart.vertex_count);
  vertex_positions(heart, fourier_basis(0.0, heart.harmonics), mesh.vertices);
  for (std::size_t i = 0; i < heart.triangles.size(); i += 3) {
    mesh.triangles.push_back({heart.triangles[i], heart.triangles[i + 1], heart.triangles[i + 2]});
  }
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
