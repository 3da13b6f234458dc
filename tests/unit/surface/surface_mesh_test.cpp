#include "core/surface/surface_mesh.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <set>

#include "made_organ.hpp"

namespace perimap {
namespace {

using test::kLayout;

PeriodicSurface fitted(std::size_t features, double hole_mm, unsigned seed) {
  std::mt19937_64 random(seed);
  const auto places = test::places_on_disc(features, 40.0, 3.5, random, hole_mm);
  return PeriodicSurface::fit(kLayout, test::evidence_on(places, 0.1, random), Vector3d::Zero()).value();
}

// Area over the chart of the triangles whose middle is within the radius.
double area_within(const PeriodicSurface& surface, const SurfaceMesh& mesh, double radius_mm) {
  double area = 0.0;
  for (const auto& triangle : mesh.triangles) {
    Vector2d s[3];
    for (std::size_t corner = 0; corner < 3; ++corner) {
      s[corner] = surface.chart().place_of(mesh.coefficients_W_mm.block<3, 1>(3 * Eigen::Index{triangle[corner]}, 0)).s;
    }
    if (((s[0] + s[1] + s[2]) / 3.0).norm() > radius_mm) continue;
    const Vector2d a = s[1] - s[0];
    const Vector2d b = s[2] - s[0];
    area += 0.5 * std::abs(a.x() * b.y() - a.y() * b.x());
  }
  return area;
}

TEST(SurfaceMesh, CoversWhatFeaturesSupport) {
  const PeriodicSurface surface = fitted(100, 0.0, 31);
  const SurfaceMesh mesh = mesh_of(surface, 1000);
  EXPECT_GT(mesh.vertices(), 500);
  EXPECT_LT(mesh.vertices(), 1100);
  const double disc = 3.1416 * 35.0 * 35.0;
  // Seen from the chart's axis, which is not quite the organ's.
  EXPECT_GT(area_within(surface, mesh, 35.0), 0.95 * disc);
}

TEST(SurfaceMesh, LeavesAHoleWhereThereAreNoFeatures) {
  const PeriodicSurface surface = fitted(80, 24.0, 32);
  const SurfaceMesh mesh = mesh_of(surface, 1500);
  const double inner_mm = 24.0 - surface.support().reach_mm();
  ASSERT_GT(inner_mm, 8.0);
  EXPECT_EQ(area_within(surface, mesh, inner_mm - 4.0), 0.0);
}

TEST(SurfaceMesh, EndsBesideTheLastFeatures) {
  const PeriodicSurface surface = fitted(100, 0.0, 33);
  const SurfaceMesh mesh = mesh_of(surface, 1500);
  double last_feature = 0.0;
  for (const Vector2d& s : surface.support().places()) last_feature = std::max(last_feature, s.norm());
  double furthest = 0.0;
  for (Eigen::Index v = 0; v < mesh.vertices(); ++v) {
    furthest = std::max(furthest, surface.chart().place_of(mesh.coefficients_W_mm.block<3, 1>(3 * v, 0)).s.norm());
  }
  EXPECT_GT(furthest, 0.9 * last_feature);
  EXPECT_LT(furthest, last_feature + surface.support().margin_mm());
}

// A ball of 40 mm, whose features end where the camera's rays meet it at 65 degrees and more: what is beyond turns away
// faster than they tell.
TEST(SurfaceMesh, EndsSoonerWhereItMayTurnAway) {
  std::mt19937_64 random(37);
  std::vector<SurfaceEvidence> evidence;
  for (const Vector2d& s : test::places_on_disc(110, 27.5, 3.0, random)) {
    SurfaceEvidence feature = test::evidence_at(static_cast<std::uint32_t>(evidence.size() + 1), s, 0.05, random);
    const Vector3d ray(s.x() / 100.0, s.y() / 100.0, 1.0);
    const Vector3d centre(0.0, 0.0, 140.0);
    const double a = ray.squaredNorm();
    const double b = ray.dot(centre);
    const Vector3d p = (b - std::sqrt(b * b - a * (centre.squaredNorm() - 1600.0))) / a * ray;
    for (int axis = 0; axis < 3; ++axis) feature.x(axis * kLayout.size()) = p(axis);
    evidence.push_back(feature);
  }
  const auto surface = PeriodicSurface::fit(kLayout, evidence, Vector3d::Zero());
  ASSERT_TRUE(surface.has_value()) << surface.error().message;
  const EvidenceSupport& support = surface->support();
  ASSERT_GT(support.margin_mm(), 2.0 * support.edge_mm());
  const SurfaceMesh mesh = mesh_of(*surface, 4000);
  double last_feature = 0.0;
  for (const Vector2d& s : support.places()) last_feature = std::max(last_feature, s.norm());
  double furthest = 0.0;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) {
      furthest = std::max(
          furthest, surface->chart().place_of(mesh.coefficients_W_mm.block<3, 1>(3 * Eigen::Index{v}, 0)).s.norm());
    }
  }
  EXPECT_LT(furthest, last_feature + 0.7 * support.margin_mm());
}

TEST(SurfaceMesh, HasNoTriangleWhereItIsUncertain) {
  std::mt19937_64 random(38);
  auto evidence = test::evidence_on(test::places_on_disc(100, 40.0, 3.5, random), 0.1, random);
  // What lies to one side is known to 3 mm.
  for (SurfaceEvidence& feature : evidence) {
    if (feature.x(0) < 5.0) continue;
    feature.mean_mm2 += 9.0 * Matrix3d::Identity();
  }
  const auto surface = PeriodicSurface::fit(kLayout, evidence, Vector3d::Zero());
  ASSERT_TRUE(surface.has_value());
  const SurfaceMesh mesh = mesh_of(*surface, 1000);
  ASSERT_EQ(static_cast<Eigen::Index>(mesh.support.size()), mesh.vertices());
  EXPECT_GT(std::count(mesh.support.begin(), mesh.support.end(), Support::kUncertain), 50);
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t v : triangle) EXPECT_EQ(mesh.support[v], Support::kSupported);
  }
}

TEST(SurfaceMesh, ShowsItsFrontToTheCamera) {
  const PeriodicSurface surface = fitted(60, 0.0, 34);
  const SurfaceMesh mesh = mesh_of(surface, 400);
  ASSERT_FALSE(mesh.triangles.empty());
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& triangle : mesh.triangles) {
    Vector3d p[3];
    for (std::size_t corner = 0; corner < 3; ++corner) {
      p[corner] = mesh.coefficients_W_mm.block<3, 1>(3 * Eigen::Index{triangle[corner]}, 0);
      // No edge is there twice in one sense: the mesh is a manifold.
      EXPECT_TRUE(edges.emplace(triangle[corner], triangle[(corner + 1) % 3]).second);
    }
    EXPECT_LT((p[1] - p[0]).cross(p[2] - p[0]).dot(p[0] - surface.chart().X_WA.t), 0.0);
  }
}

TEST(SurfaceMesh, SpansNoStepInDepth) {
  std::mt19937_64 random(35);
  std::vector<Vector2d> places = test::places_on_disc(120, 40.0, 3.0, random);
  auto evidence = test::evidence_on(places, 0.05, random);
  // Half of them lie on something that is far nearer.
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i].x() > 0.0) continue;
    for (int axis = 0; axis < 3; ++axis) evidence[i].x(axis * kLayout.size()) *= 0.4;
  }
  SurfaceSettings settings;
  settings.largest_deviation_mm = 100.0;
  settings.contradiction = 1e9;
  const auto surface = PeriodicSurface::fit(kLayout, evidence, Vector3d::Zero(), settings);
  ASSERT_TRUE(surface.has_value());
  const SurfaceMesh mesh = mesh_of(*surface, 4000);
  double widest = 0.0;
  for (const auto& triangle : mesh.triangles) {
    double low = 1e9;
    double high = 0.0;
    for (const std::uint32_t corner : triangle) {
      const double z = mesh.coefficients_W_mm(3 * Eigen::Index{corner} + 2, 0);
      low = std::min(low, z);
      high = std::max(high, z);
    }
    widest = std::max(widest, high - low);
  }
  EXPECT_LT(widest, 12.0);
}

TEST(EvaluatedSurface, IsTheSeriesAtThePhase) {
  const PeriodicSurface surface = fitted(60, 0.0, 36);
  const SurfaceMesh mesh = mesh_of(surface, 500);
  EvaluatedSurface evaluated(mesh);
  const Basis b = basis_at(kLayout, 1.3);
  const Basis rate = basis_rate(kLayout, 1.3);
  constexpr double kPhaseDeviation_rad = 0.05;
  evaluated.evaluate(mesh, b, rate, kPhaseDeviation_rad);
  for (Eigen::Index v = 0; v < mesh.vertices(); ++v) {
    const auto c = mesh.coefficients_W_mm.middleRows<3>(3 * v);
    EXPECT_LT((evaluated.positions().col(v) - c * b).norm(), 1e-9);
    EXPECT_LT((evaluated.rates().col(v) - c * rate).norm(), 1e-9);
    const auto six = mesh.covariances_W_mm2.col(v);
    Matrix3d covariance;
    covariance << six(0), six(1), six(2), six(1), six(3), six(4), six(2), six(4), six(5);
    const Vector3d velocity = kPhaseDeviation_rad * (c * rate);
    covariance += velocity * velocity.transpose();
    const double largest = Eigen::SelfAdjointEigenSolver<Matrix3d>(covariance).eigenvalues()(2);
    EXPECT_GE(evaluated.deviations()(v), std::sqrt(largest) - 1e-9);
    EXPECT_LE(evaluated.deviations()(v), std::sqrt(2.0 * largest) + 1e-9);
  }
}

}  // namespace
}  // namespace perimap
