#include "drivers/standins/truth/ground_truth.hpp"

#include <gtest/gtest.h>

#include "drivers/standins/simulator/lens.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

// Two triangles facing -z at z = 100 and z = 120, which sway along x by 5 mm cos(phase).
GroundTruth two_triangles() {
  HeartMesh mesh;
  mesh.vertex_count = 6;
  mesh.harmonics = 1;
  for (const double z : {100.0, 120.0})
    for (const auto& xy : {Vector2d(-30.0, -30.0), Vector2d(0.0, 30.0), Vector2d(30.0, -30.0)}) {
      mesh.coefficients_mm.insert(mesh.coefficients_mm.end(), {xy.x(), 5.0, 0.0});
      mesh.coefficients_mm.insert(mesh.coefficients_mm.end(), {xy.y(), 0.0, 0.0});
      mesh.coefficients_mm.insert(mesh.coefficients_mm.end(), {z, 0.0, 0.0});
    }
  mesh.triangles = {3, 4, 5, 0, 1, 2};
  HeartMotion motion;
  motion.r_peaks = {from_ns(1'000'000'000), from_ns(2'000'000'000)};
  return GroundTruth::create(mesh, motion,
                             {{from_ns(7), Pose{}}, {from_ns(5), Pose{Matrix3d::Identity(), Vector3d::UnitX()}}})
      .value();
}

TEST(GroundTruth, HitsTheFrontMostTriangle) {
  const GroundTruth truth = two_triangles();
  const Instant r_peak = from_ns(1'000'000'000);
  const auto hit = truth.first_hit(Pose{}, Vector3d(0.05, -0.02, 1.0), r_peak);
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->triangle, 1U);
  EXPECT_LT((truth.position(*hit, r_peak) - Vector3d(5.0, -2.0, 100.0)).norm(), 1e-9);
}

TEST(GroundTruth, HitsFromBehindWhenTheCameraStandsThere) {
  const GroundTruth truth = two_triangles();
  const Pose X_WC{so3_exp(Vector3d(0.0, 3.14159265358979, 0.0)), Vector3d(5.0, 0.0, 200.0)};
  const auto hit = truth.first_hit(X_WC, Vector3d::UnitZ(), from_ns(1'000'000'000));
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->triangle, 0U);
}

TEST(GroundTruth, ARayBesideTheHeartHitsNothing) {
  const GroundTruth truth = two_triangles();
  EXPECT_FALSE(truth.first_hit(Pose{}, Vector3d(1.0, 0.0, 1.0), from_ns(1'000'000'000)).has_value());
  EXPECT_FALSE(truth.first_hit(Pose{}, Vector3d(0.0, 0.0, -1.0), from_ns(1'000'000'000)).has_value())
      << "what lies behind the camera is not seen";
}

TEST(GroundTruth, AMaterialPointMovesWithTheHeart) {
  const GroundTruth truth = two_triangles();
  const Instant r_peak = from_ns(1'000'000'000);
  const auto hit = truth.first_hit(Pose{}, Vector3d(0.05, 0.0, 1.0), r_peak);
  ASSERT_TRUE(hit.has_value());
  // Half a cycle later cos(phase) = -1: 10 mm to the left.
  EXPECT_LT((truth.position(*hit, r_peak + milliseconds(500)) - Vector3d(-5.0, 0.0, 100.0)).norm(), 1e-9);
}

TEST(GroundTruth, KnowsTheCameraOfEachCaptureAndOfNoOther) {
  const GroundTruth truth = two_triangles();
  ASSERT_TRUE(truth.camera_pose(from_ns(5)).has_value());
  EXPECT_EQ(truth.camera_pose(from_ns(5))->t, Vector3d::UnitX());
  EXPECT_TRUE(truth.camera_pose(from_ns(7)).has_value());
  EXPECT_FALSE(truth.camera_pose(from_ns(6)).has_value());
  EXPECT_FALSE(truth.camera_pose(from_ns(8)).has_value());
}

TEST(ScopeLens, RaysComeBackToTheirPixels) {
  const ScopeLens lens = scope_lens(640, 480);
  for (const double u : {0.0, 17.3, 320.0, 639.0})
    for (const double v : {0.0, 111.9, 240.0, 479.0}) {
      const Vector3d ray = lens.ray({u, v});
      EXPECT_LT((lens.project(73.0 * ray) - Vector2d(u, v)).norm(), 1e-8) << u << ", " << v;
    }
}

TEST(ScopeLens, DistortsByBrownConradyInOpenCvsOrder) {
  ScopeLens lens{640, 480, 100.0, 100.0, 0.0, 0.0, 0.1, 0.01, 0.002, 0.003, 0.001};
  // x = 0.5, y = 0.25, r^2 = 0.3125: radial 1.032257080078125; tangential x 2 p1 x y + p2 (r^2 + 2 x^2) = 0.0029375,
  // y p1 (r^2 + 2 y^2) + 2 p2 x y = 0.001625.
  const Vector2d pixel = lens.project({5.0, 2.5, 10.0});
  EXPECT_NEAR(pixel.x(), 100.0 * (0.5 * 1.032257080078125 + 0.0029375), 1e-9);
  EXPECT_NEAR(pixel.y(), 100.0 * (0.25 * 1.032257080078125 + 0.001625), 1e-9);
}

}  // namespace
}  // namespace perimap
