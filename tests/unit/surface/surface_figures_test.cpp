#include "daemon/evaluation/surface/surface_figures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "daemon/evaluation/surface/seen_surface.hpp"
#include "daemon/evaluation/surface/surface_baselines.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

TEST(SurfaceTally, CountsFromFifteenSecondsOn) {
  SurfaceTally tally;
  tally.begin_instant(14.0);
  for (int i = 0; i < 10; ++i) tally.add_seen(i != 0);
  tally.add(0, {0, false, 5.0, 9.0});
  tally.add_compared(5.0, 5.0, 5.0);
  tally.end_instant();
  for (const double t : {15.0, 16.0}) {
    tally.begin_instant(t);
    for (int i = 0; i < 10; ++i) tally.add_seen(i < (t < 15.5 ? 10 : 8));
    tally.add(0, {3, false, 3.0, 1.0});
    tally.add(0, {4, false, 4.0, 2.0});
    tally.add(0, {5, true, 7.0, 100.0});
    tally.add(2, {3, false, 6.0, 3.0});
    tally.add_compared(1.0, 2.0, 3.0);
    tally.end_instant();
  }
  const SurfaceFigures figures = tally.figures();
  EXPECT_EQ(figures.instants, 2U);
  EXPECT_EQ(figures.points, 2U);
  EXPECT_NEAR(figures.horizons[0].rms_mm, std::sqrt(12.5), 1e-9);
  EXPECT_NEAR(figures.horizons[0].nees, 1.5, 1e-9);
  EXPECT_TRUE(std::isnan(figures.horizons[1].rms_mm));
  EXPECT_NEAR(figures.horizons[2].rms_mm, 6.0, 1e-9);
  EXPECT_NEAR(figures.p95_mm, 4.0, 1e-6);
  EXPECT_NEAR(figures.rim_rms_mm, 7.0, 1e-9);
  EXPECT_NEAR(figures.coverage, 0.9, 1e-9);
  EXPECT_EQ(figures.time_to_90_percent_s, 14.0);
  EXPECT_NEAR(figures.barycentric.rms_mm, 2.0, 1e-6);
  EXPECT_NEAR(figures.thin_plate.p95_mm, 3.0, 1e-6);
}

TEST(SurfaceTally, CountsSeenPointsWithoutASurfaceAsNotCovered) {
  SurfaceTally tally;
  tally.begin_instant(20.0);
  for (int i = 0; i < 10; ++i) tally.add_seen(false);
  tally.end_instant();
  EXPECT_EQ(tally.figures().coverage, 0.0);
  EXPECT_TRUE(std::isnan(tally.figures().time_to_90_percent_s));
  const nlohmann::json json = to_json(tally.figures());
  EXPECT_TRUE(json.at("rms_mm").is_null());
  EXPECT_EQ(json.at("points"), 0);
  EXPECT_NE(to_text(tally.figures()).find("none from 15 s on"), std::string::npos);
}

TEST(SurfaceTally, CountsCoverageOfWhatWasSeenWell) {
  SurfaceTally tally;
  tally.begin_instant(20.0);
  for (int i = 0; i < 10; ++i) tally.add_seen(i < 9, true);
  for (int i = 0; i < 10; ++i) tally.add_seen(i < 1, false);
  tally.add(0, {3, true, 2.0, 4.0});
  tally.end_instant();
  EXPECT_NEAR(tally.figures().coverage, 0.9, 1e-9);
  EXPECT_NEAR(tally.figures().coverage_at_any_angle, 0.5, 1e-9);
  EXPECT_NEAR(tally.figures().rim_nees, 4.0, 1e-9);
}

TEST(SurfaceFigures, HaveTheKeysThatOthersRead) {
  const nlohmann::json json = to_json(SurfaceFigures{});
  for (const char* key : {"points", "rms_mm", "p95_mm", "nees", "rim_rms_mm", "coverage", "time_to_90_percent_s"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
}

std::vector<Vector2d> at_random(unsigned seed, std::size_t count, double half_mm) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-half_mm, half_mm);
  std::vector<Vector2d> places;
  for (std::size_t i = 0; i < count; ++i) places.emplace_back(place(random), place(random));
  return places;
}

TEST(SurfaceBaselines, AreExactForAPlaneAndAtTheFeatures) {
  const auto features = at_random(1, 30, 40.0);
  const auto places = at_random(2, 50, 15.0);
  const auto plane = [](const Vector2d& s) { return 3.0 + 0.2 * s.x() - 0.7 * s.y(); };
  Eigen::VectorXd heights(30);
  Eigen::VectorXd rough(30);
  for (Eigen::Index i = 0; i < 30; ++i) {
    heights(i) = plane(features[static_cast<std::size_t>(i)]);
    rough(i) = std::sin(static_cast<double>(7 * i));
  }
  const Eigen::MatrixXd barycentric = barycentric_weights(features, places);
  const Eigen::MatrixXd thin_plate = thin_plate_weights(features, places);
  std::size_t within = 0;
  for (Eigen::Index v = 0; v < 50; ++v) {
    const double height = plane(places[static_cast<std::size_t>(v)]);
    EXPECT_NEAR(heights.dot(thin_plate.col(v)), height, 1e-6);
    if (barycentric.col(v).isZero()) continue;
    ++within;
    // Of Delaunay's triangles only the corners, which OpenCV holds as floats, are used.
    EXPECT_NEAR(heights.dot(barycentric.col(v)), height, 1e-6);
    EXPECT_GE(barycentric.col(v).minCoeff(), 0.0);
  }
  EXPECT_GT(within, 45U);
  const Eigen::MatrixXd through = thin_plate_weights(features, features);
  EXPECT_LT((through.transpose() * rough - rough).norm(), 1e-6);
  EXPECT_TRUE(barycentric_weights(features, {Vector2d(500.0, 0.0)}).isZero());
}

// A square of 200 mm at z = 100 mm before the camera, which sees 96 by 96 mm of it.
GroundTruth still_square() {
  HeartMesh mesh;
  mesh.vertex_count = 4;
  mesh.harmonics = 0;
  mesh.coefficients_mm = {-100, -100, 100, 100, -100, 100, 100, 100, 100, -100, 100, 100};
  mesh.triangles = {0, 2, 1, 0, 3, 2};
  HeartMotion motion;
  for (int i = 0; i < 40; ++i) motion.r_peaks.push_back(Instant(milliseconds(800 * i)));
  std::vector<CameraTruth> cameras;
  for (int i = 0; i < 4; ++i) cameras.push_back({Instant(milliseconds(1000 * i)), Pose{}});
  auto truth = GroundTruth::create(mesh, motion, cameras);
  EXPECT_TRUE(truth.has_value());
  return std::move(*truth);
}

TEST(SeenSurface, IsWhatWasInTheImageThreeTimes) {
  const GroundTruth truth = still_square();
  CameraModel camera;
  camera.width = camera.height = 480;
  camera.fx = camera.fy = 500;
  camera.cx = camera.cy = 239.5;
  SeenSurface surface(truth, camera);
  surface.look(Instant(milliseconds(0)));
  surface.look(Instant(milliseconds(1000)));
  surface.look(Instant(milliseconds(1500)));  // no frame was captured then
  EXPECT_TRUE(surface.seen().empty());
  surface.look(Instant(milliseconds(2000)));
  // A point for 2 mm^2.
  EXPECT_NEAR(static_cast<double>(surface.seen().size()), 96.0 * 96.0 / 2.0, 200.0);
  std::size_t rim = 0;
  for (const std::size_t point : surface.seen()) {
    const Vector3d& p = surface.mean_place(point);
    const double from_edge = 48.0 - std::max(std::abs(p.x()), std::abs(p.y()));
    ASSERT_GT(from_edge, 0.0);
    if (surface.on_rim(point)) {
      ++rim;
      EXPECT_LT(from_edge, 5.0);
    } else {
      EXPECT_GT(from_edge, 2.5);
    }
  }
  EXPECT_GT(rim, 500U);
}

// Lying 70 degrees off, it is in the image all the same.
TEST(SeenSurface, DoesNotSeeWellWhatItSeesObliquely) {
  const Matrix3d turn = so3_exp(Vector3d(0.0, 70.0 * 3.14159265 / 180.0, 0.0));
  std::vector<CameraTruth> cameras;
  const Vector3d middle(0.0, 0.0, 100.0);
  for (int i = 0; i < 4; ++i) cameras.push_back({Instant(milliseconds(1000 * i)), Pose{turn, middle - turn * middle}});
  const auto truth = GroundTruth::create(still_square().mesh(), still_square().motion(), cameras);
  ASSERT_TRUE(truth.has_value());
  CameraModel camera;
  camera.width = camera.height = 100;
  camera.fx = camera.fy = 500;
  camera.cx = camera.cy = 49.5;
  SeenSurface surface(*truth, camera);
  for (int i = 0; i < 3; ++i) surface.look(Instant(milliseconds(1000 * i)));
  EXPECT_GT(surface.seen().size(), 50U);
  for (const std::size_t point : surface.seen()) {
    EXPECT_FALSE(surface.seen_well(point));
    EXPECT_TRUE(surface.on_rim(point));
  }
}

TEST(SeenSurface, DoesNotSeeTheBack) {
  HeartMesh mesh = still_square().mesh();
  std::swap(mesh.triangles[1], mesh.triangles[2]);
  std::swap(mesh.triangles[4], mesh.triangles[5]);
  const auto truth = GroundTruth::create(mesh, still_square().motion(), {{Instant(milliseconds(0)), Pose{}}});
  ASSERT_TRUE(truth.has_value());
  CameraModel camera;
  camera.width = camera.height = 480;
  camera.fx = camera.fy = 500;
  camera.cx = camera.cy = 239.5;
  SeenSurface surface(*truth, camera);
  for (int i = 0; i < 3; ++i) surface.look(Instant(milliseconds(0)));
  EXPECT_TRUE(surface.seen().empty());
}

}  // namespace
}  // namespace perimap
