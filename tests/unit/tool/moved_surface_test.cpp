#include "core/tool/moved_surface.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/periodic/basis.hpp"
#include "made_mesh.hpp"

namespace perimap {
namespace {

using test::phase_of;
using test::sheet;

// By walking over each triangle in small steps.
double brute_distance(const SurfaceMesh& mesh, const Basis& b, const Vector3d& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& corners : mesh.triangles) {
    Vector3d at[3];
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] = mesh.coefficients_W_mm.middleRows<3>(3 * static_cast<Eigen::Index>(corners[k])) * b;
    }
    constexpr int kSteps = 60;
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        const double u = static_cast<double>(i) / kSteps, v = static_cast<double>(j) / kSteps;
        least = std::min(least, (at[0] + u * (at[1] - at[0]) + v * (at[2] - at[0]) - p).norm());
      }
    }
  }
  return least;
}

TEST(MovedSurface, TheNearestPlaceIsThatOfABruteSearch) {
  const SurfaceMesh mesh = sheet(9);
  const MeshBorder border(mesh.triangles, mesh.support.size());
  MovedSurface moved(100);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> across(-25.0, 25.0), away(-15.0, 15.0), phase(0.0, 6.28);
  for (int n = 0; n < 60; ++n) {
    const PhaseEstimate estimate = phase_of(phase(random));
    moved.move(mesh, estimate, {});
    const Vector3d p(across(random), across(random), away(random));
    const PlaceOnSurface place = moved.nearest(border, p);
    const double brute = brute_distance(mesh, basis_without_breath(mesh.layout, estimate.phase_rad), p);
    ASSERT_TRUE(place.any);
    EXPECT_NEAR(std::abs(place.distance_mm), (place.point_W_mm - p).norm(), 1e-9);
    EXPECT_LE(std::abs(place.distance_mm), brute + 1e-9);
    EXPECT_GT(std::abs(place.distance_mm), brute - 0.1);
  }
}

TEST(MovedSurface, DistancesArePositiveInFrontAndNegativeWithin) {
  const SurfaceMesh mesh = sheet(9);
  const MeshBorder border(mesh.triangles, mesh.support.size());
  MovedSurface moved(100);
  moved.move(mesh, phase_of(1.0), {});
  // The sheet's front looks along -z.
  EXPECT_GT(moved.nearest(border, {0.0, 0.0, -20.0}).distance_mm, 10.0);
  EXPECT_LT(moved.nearest(border, {0.0, 0.0, 20.0}).distance_mm, -10.0);
  EXPECT_LT(moved.nearest(border, {0.0, 0.0, -20.0}).normal_W.z(), -0.9);
}

TEST(MovedSurface, BesideTheMeshThePlaceIsOnTheBorder) {
  const SurfaceMesh mesh = sheet(9);
  const MeshBorder border(mesh.triangles, mesh.support.size());
  MovedSurface moved(100);
  moved.move(mesh, phase_of(0.0), {});
  EXPECT_FALSE(moved.nearest(border, {0.0, 0.0, -5.0}).on_border);
  EXPECT_TRUE(moved.nearest(border, {40.0, 0.0, 0.0}).on_border);
  EXPECT_TRUE(moved.nearest(border, {40.0, 40.0, 0.0}).on_border);
}

TEST(MovedSurface, OverAHoleThePlaceIsOnItsBorder) {
  SurfaceMesh mesh = sheet(9);
  // A vertex in the middle and all its triangles are not known.
  std::erase_if(mesh.triangles, [](const auto& t) { return std::find(t.begin(), t.end(), 40U) != t.end(); });
  const MeshBorder border(mesh.triangles, mesh.support.size());
  MovedSurface moved(100);
  moved.move(mesh, phase_of(0.0), {});
  EXPECT_TRUE(moved.nearest(border, {0.0, 0.0, -3.0}).on_border);
  EXPECT_FALSE(moved.nearest(border, {15.0, 0.0, -3.0}).on_border);
}

TEST(MovedSurface, ItsVelocityIsWhatThePlaceDoes) {
  const SurfaceMesh mesh = sheet(9);
  const MeshBorder border(mesh.triangles, mesh.support.size());
  MovedSurface moved(100);
  constexpr double kStep_s = 1e-5;
  for (double phase_rad = 0.1; phase_rad < 6.0; phase_rad += 0.7) {
    PhaseEstimate before = phase_of(phase_rad), after = before;
    after.phase_rad += kStep_s * before.rate_rad_per_s;
    const Vector3d p(0.5, 0.5, -0.0);
    moved.move(mesh, before, {});
    const PlaceOnSurface here = moved.nearest(border, p);
    moved.move(mesh, after, {});
    const double rate = (moved.nearest(border, p).distance_mm - here.distance_mm) / kStep_s;
    // A point that stands still: what the distance does is what the surface does along its normal.
    EXPECT_NEAR(rate, -here.normal_W.dot(here.velocity_W_mm_per_s), 0.02 * (1.0 + std::abs(rate)));
  }
}

TEST(MovedSurface, ItsVarianceIsTheVerticesAlongTheNormalAndThePhases) {
  SurfaceMesh mesh = sheet(9);
  mesh.covariances_W_mm2.setZero();
  mesh.covariances_W_mm2.row(0).setConstant(9.0);   // across
  mesh.covariances_W_mm2.row(5).setConstant(0.25);  // along the normal, nearly
  const MeshBorder border(mesh.triangles, mesh.support.size());
  MovedSurface moved(100);
  PhaseEstimate phase = phase_of(0.0);
  moved.move(mesh, phase, {});
  const double exact = moved.nearest(border, {0.0, 0.0, -5.0}).variance_mm2;
  EXPECT_NEAR(exact, 0.25, 0.1);
  phase.deviation_s = 0.05;
  moved.move(mesh, phase, {});
  EXPECT_GT(moved.nearest(border, {0.0, 0.0, -5.0}).variance_mm2, exact + 0.05);
  RespiratoryPhase breath;
  breath.deviation_mm = 2.0;
  moved.move(mesh, phase_of(0.0), breath);
  EXPECT_NEAR(moved.nearest(border, {0.0, 0.0, -5.0}).variance_mm2, exact + 4.0, 1e-9);
}

TEST(MovedSurface, SaysNothingOfAPointThatIsNoneOrOfAnEmptyMesh) {
  const SurfaceMesh mesh = sheet(3);
  MovedSurface moved(1);
  EXPECT_FALSE(moved.nearest(MeshBorder(mesh.triangles, mesh.support.size()), Vector3d::Zero()).any);
  moved.move(mesh, phase_of(0.0), {});
  EXPECT_FALSE(moved
                   .nearest(MeshBorder(mesh.triangles, mesh.support.size()),
                            {std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0})
                   .any);
  SurfaceMesh empty = mesh;
  empty.triangles.clear();
  moved.move(empty, phase_of(0.0), {});
  EXPECT_FALSE(moved.nearest(MeshBorder(empty.triangles, empty.support.size()), Vector3d::Zero()).any);
}

}  // namespace
}  // namespace perimap
