#include "heart_patch.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "drivers/standins/random/counter_noise.hpp"

namespace perimap::test {
namespace {

constexpr double kScope_mm = 120.0;  // from the surface
constexpr double kApart_mm = 4.0;    // features
constexpr double kFaced = 0.5;       // cosine of what is followed

constexpr std::uint64_t kPlace = 1;  // a stream of numbers

}  // namespace

Vector3d towards_scope() { return Vector3d(0.45, -0.80, -0.38).normalized(); }

PlaceHarmonics harmonics_of(const HeartMesh& heart, std::uint32_t vertex) {
  const auto n = static_cast<Eigen::Index>(heart.coefficients_per_axis());
  return Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>>(
      heart.coefficients_mm.data() + 3 * n * vertex, 3, n);
}

HeartPatch patch_of(const HeartMesh& heart, const SeenSettings& settings) {
  const Vector3d axis = towards_scope();
  std::vector<Vector3d> p(heart.vertex_count);
  vertex_positions(heart, fourier_basis(0.0, heart.harmonics), p);
  Vector3d middle = Vector3d::Zero();
  for (const Vector3d& q : p) middle += q / static_cast<double>(p.size());
  HeartPatch patch;
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

std::vector<PlaceHarmonics> features_of(const HeartMesh& heart, const HeartPatch& patch, const SeenSettings& settings,
                                        std::uint64_t seed) {
  const CounterNoise noise(seed, kPlace);
  std::vector<PlaceHarmonics> features;
  for (std::uint64_t draw = 0; features.size() < settings.features && draw < 200'000; ++draw) {
    const std::size_t t = patch.triangles[noise.bits(3 * draw) % patch.triangles.size()];
    double u = noise.uniform(3 * draw + 1), v = noise.uniform(3 * draw + 2);
    if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
    const PlaceHarmonics c = (1.0 - u - v) * harmonics_of(heart, heart.triangles[t]) +
                             u * harmonics_of(heart, heart.triangles[t + 1]) +
                             v * harmonics_of(heart, heart.triangles[t + 2]);
    const bool near = std::any_of(features.begin(), features.end(), [&](const PlaceHarmonics& other) {
      return (other.col(0) - c.col(0)).norm() < kApart_mm;
    });
    if (!near) features.push_back(c);
  }
  return features;
}

SurfaceEvidence evidence_of(const PlaceHarmonics& truth, std::uint32_t id, const SeenSettings& settings,
                            std::uint64_t seed, const Vector3d& common_W) {
  const CounterNoise noise(seed, 1000 + id);
  const Vector3d axis = towards_scope();
  const double own = settings.feature_mm;
  // The symmetric root of sigma^2 (I + 3 a a^T).
  const Matrix3d root = own * (Matrix3d::Identity() + axis * axis.transpose());
  SurfaceEvidence evidence;
  evidence.id = id;
  const double common_mm2 = settings.common_mm * settings.common_mm / 3.0;
  evidence.mean_mm2 = root * root + common_mm2 * Matrix3d::Identity();
  evidence.bands_mm2.fill(0.25 * root * root);
  PlaceHarmonics c = truth;
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

}  // namespace perimap::test
