#include "core/geometry/camera_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <random>
#include <vector>

namespace perimap {
namespace {

const CameraModel kPinhole{.width = 1280, .height = 720, .fx = 700.0, .fy = 705.0, .cx = 640.0, .cy = 360.0};
// A laparoscope's barrel distortion, and a milder lens with all five coefficients.
const CameraModel kBarrel{.width = 640,
                          .height = 480,
                          .fx = 520.0,
                          .fy = 525.0,
                          .cx = 310.0,
                          .cy = 250.0,
                          .k1 = -0.32,
                          .k2 = 0.12,
                          .p1 = 0.0006,
                          .p2 = -0.0009,
                          .k3 = -0.02};
const CameraModel kPincushion{.width = 640,
                              .height = 480,
                              .fx = 600.0,
                              .fy = 590.0,
                              .cx = 322.0,
                              .cy = 241.0,
                              .k1 = 0.11,
                              .k2 = -0.02,
                              .p1 = -0.002,
                              .p2 = 0.001,
                              .k3 = 0.004};
const CameraModel kCameras[] = {kPinhole, kBarrel, kPincushion};

cv::Mat matrix_of(const CameraModel& c) { return (cv::Mat_<double>(3, 3) << c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1); }
cv::Mat distortion_of(const CameraModel& c) { return (cv::Mat_<double>(1, 5) << c.k1, c.k2, c.p1, c.p2, c.k3); }

std::vector<Vector3d> points_in_view(const CameraModel& camera, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  std::vector<Vector3d> points;
  for (int i = 0; i < 200; ++i) {
    const double Z = 5.0 + 200.0 * u(generator);
    points.emplace_back((u(generator) * camera.width - camera.cx) / camera.fx * Z,
                        (u(generator) * camera.height - camera.cy) / camera.fy * Z, Z);
  }
  return points;
}

TEST(CameraModel, ProjectsAsOpenCvDoes) {
  for (const CameraModel& camera : kCameras) {
    for (const Vector3d& p : points_in_view(camera, 1)) {
      Vector2d px;
      Matrix23d J;
      ASSERT_EQ(camera.project(p, px, &J), ProjectionStatus::kOk);
      std::vector<cv::Point2d> expected;
      cv::Mat jacobian;
      cv::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0),
                        matrix_of(camera), distortion_of(camera), expected, jacobian);
      EXPECT_NEAR(px.x(), expected[0].x, 1e-9);
      EXPECT_NEAR(px.y(), expected[0].y, 1e-9);
      // OpenCV's columns 3..5 are by translation, which is by the point when the rotation is the identity.
      for (int i = 0; i < 2; ++i) {
        for (int j = 0; j < 3; ++j) EXPECT_NEAR(J(i, j), jacobian.at<double>(i, 3 + j), 1e-9 * camera.fx);
      }
    }
  }
}

TEST(CameraModel, UnprojectsAsOpenCvDoes) {
  for (const CameraModel& camera : kCameras) {
    for (int v = 0; v < camera.height; v += 37) {
      for (int u = 0; u < camera.width; u += 41) {
        Vector3d ray;
        ASSERT_TRUE(camera.unproject({u, v}, ray)) << u << ' ' << v;
        std::vector<cv::Point2d> expected;
        cv::undistortPoints(std::vector<cv::Point2d>{{double(u), double(v)}}, expected, matrix_of(camera),
                            distortion_of(camera), cv::noArray(), cv::noArray(),
                            cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 500, 1e-13));
        EXPECT_NEAR(ray.norm(), 1.0, 1e-14);
        EXPECT_NEAR(ray.x() / ray.z(), expected[0].x, 1e-9);
        EXPECT_NEAR(ray.y() / ray.z(), expected[0].y, 1e-9);
      }
    }
  }
}

TEST(CameraModel, UnprojectUndoesProject) {
  for (const CameraModel& camera : kCameras) {
    for (const Vector3d& p : points_in_view(camera, 2)) {
      Vector2d px;
      Vector3d ray;
      ASSERT_EQ(camera.project(p, px), ProjectionStatus::kOk);
      ASSERT_TRUE(camera.unproject(px, ray));
      EXPECT_LT((ray - p.normalized()).norm(), 1e-10);
    }
  }
}

TEST(CameraModel, SaysWhenAPointIsNotInFront) {
  Vector2d px(1.0, 2.0);
  for (const Vector3d& p : {Vector3d(1, 2, -50), Vector3d(0, 0, 0), Vector3d(3, 0, 0)}) {
    EXPECT_EQ(kBarrel.project(p, px), ProjectionStatus::kBehindCamera);
  }
  EXPECT_EQ(px, Vector2d(1.0, 2.0)) << "untouched on failure";
}

TEST(CameraModel, SaysWhenTheDistortionFoldsBack) {
  CameraModel camera = kPinhole;
  camera.k1 = -0.3;  // r (1 - 0.3 r^2) turns back at r = sqrt(1 / 0.9) = 1.054
  Vector2d px;
  EXPECT_EQ(camera.project({1.04, 0.0, 1.0}, px), ProjectionStatus::kOk);
  EXPECT_EQ(camera.project({0.0, -1.04, 1.0}, px), ProjectionStatus::kOk);
  EXPECT_EQ(camera.project({1.07, 0.0, 1.0}, px), ProjectionStatus::kFoldedBack);
  EXPECT_EQ(camera.project({-0.8, 0.8, 1.0}, px), ProjectionStatus::kFoldedBack);
  // Folding at r = 1.14 and unfolding again at r = 2.78: further out the slope alone would look fine.
  camera.k2 = 0.02;
  for (const double k3 : {0.0, 1e-5}) {
    camera.k3 = k3;
    EXPECT_EQ(camera.project({1.1, 0.0, 1.0}, px), ProjectionStatus::kOk);
    EXPECT_EQ(camera.project({3.0, 0.0, 1.0}, px), ProjectionStatus::kFoldedBack);
  }
}

TEST(CameraModel, HasNoRayBeyondTheFold) {
  CameraModel camera = kPinhole;
  camera.k1 = -0.3;  // largest distorted radius 0.7027
  Vector3d ray(1, 2, 3);
  EXPECT_TRUE(camera.unproject({camera.cx + 0.70 * camera.fx, camera.cy}, ray));
  EXPECT_NEAR(ray.norm(), 1.0, 1e-14);
  ray = {1, 2, 3};
  EXPECT_FALSE(camera.unproject({camera.cx + 0.71 * camera.fx, camera.cy}, ray));
  EXPECT_FALSE(camera.unproject({std::numeric_limits<double>::quiet_NaN(), 0.0}, ray));
  EXPECT_EQ(ray, Vector3d(1, 2, 3)) << "untouched on failure";
}

TEST(CameraModel, RefusesWhatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  Vector2d px;
  EXPECT_EQ(kBarrel.project({nan, 0.0, 10.0}, px), ProjectionStatus::kNotFinite);
  EXPECT_EQ(kBarrel.project({0.0, 0.0, inf}, px), ProjectionStatus::kNotFinite);
}

TEST(CameraModel, KnowsItsSensor) {
  EXPECT_TRUE(kBarrel.contains({-0.4, 479.4}));
  EXPECT_FALSE(kBarrel.contains({-0.6, 10.0}));
  EXPECT_FALSE(kBarrel.contains({639.6, 10.0}));
}

// Wide lenses with k1 of either sign; none folds back before 100 degrees.
CameraModel fisheye(double k1, double k2, double k3, double k4) {
  CameraModel camera{.width = 800, .height = 800, .fx = 300.0, .fy = 305.0, .cx = 400.0, .cy = 390.0};
  camera.lens = Lens::kKannalaBrandt;
  camera.k1 = k1;
  camera.k2 = k2;
  camera.k3 = k3;
  camera.k4 = k4;
  return camera;
}
const CameraModel kFisheyes[] = {fisheye(0.0, 0.0, 0.0, 0.0), fisheye(-0.06, -0.008, 0.002, -0.0003),
                                 fisheye(0.05, 0.01, -0.004, 0.0008)};

// Directions up to `most_rad` from the axis, on it and very near it included.
std::vector<Vector3d> directions(double most_rad) {
  std::vector<Vector3d> all = {{0.0, 0.0, 1.0}, {1e-9, 0.0, 1.0}, {-3e-5, 2e-5, 1.0}, {1e-4, -1e-4, 1.0}};
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    const double theta = most_rad * u(generator);
    const double azimuth = 6.28 * u(generator);
    all.emplace_back(std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth), std::cos(theta));
  }
  return all;
}

TEST(FisheyeCamera, ProjectsAsOpenCvDoes) {
  for (const CameraModel& camera : kFisheyes) {
    const cv::Vec4d coefficients(camera.k1, camera.k2, camera.k3, camera.k4);
    for (const Vector3d& ray : directions(1.5)) {
      const Vector3d p = 70.0 * ray;
      Vector2d px;
      ASSERT_EQ(camera.project(p, px), ProjectionStatus::kOk);
      std::vector<cv::Point2d> expected;
      cv::fisheye::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, expected, cv::Vec3d(0, 0, 0),
                                 cv::Vec3d(0, 0, 0), matrix_of(camera), coefficients);
      EXPECT_NEAR(px.x(), expected[0].x, 1e-9);
      EXPECT_NEAR(px.y(), expected[0].y, 1e-9);
    }
  }
}

TEST(FisheyeCamera, JacobianIsTheDerivativeOnTheAxisAndBehindTheCameraToo) {
  for (const CameraModel& camera : kFisheyes) {
    for (const Vector3d& ray : directions(1.7)) {
      const Vector3d p = 70.0 * ray;
      Vector2d px;
      Matrix23d J;
      ASSERT_EQ(camera.project(p, px, &J), ProjectionStatus::kOk);
      for (int k = 0; k < 3; ++k) {
        constexpr double kStep_mm = 1e-3;
        Vector2d plus;
        Vector2d minus;
        ASSERT_EQ(camera.project(p + kStep_mm * Vector3d::Unit(k), plus), ProjectionStatus::kOk);
        ASSERT_EQ(camera.project(p - kStep_mm * Vector3d::Unit(k), minus), ProjectionStatus::kOk);
        EXPECT_LT((J.col(k) - (plus - minus) / (2.0 * kStep_mm)).norm(), 1e-7 * camera.fx) << ray.transpose();
      }
    }
  }
}

TEST(FisheyeCamera, UnprojectUndoesProject) {
  for (const CameraModel& camera : kFisheyes) {
    for (const Vector3d& direction : directions(1.7)) {
      Vector2d px;
      Vector3d ray;
      ASSERT_EQ(camera.project(40.0 * direction, px), ProjectionStatus::kOk);
      ASSERT_TRUE(camera.unproject(px, ray));
      EXPECT_LT((ray - direction.normalized()).norm(), 1e-10);
      EXPECT_NEAR(ray.norm(), 1.0, 1e-14);
    }
  }
}

TEST(FisheyeCamera, SaysWhereTheImageEnds) {
  const CameraModel camera = fisheye(-0.1, 0.0, 0.0, 0.0);  // theta - 0.1 theta^3 turns back at sqrt(1 / 0.3) = 1.826
  Vector2d px(1.0, 2.0);
  Vector3d ray(1.0, 2.0, 3.0);
  EXPECT_EQ(camera.project({std::sin(1.80), 0.0, std::cos(1.80)}, px), ProjectionStatus::kOk);
  px = {1.0, 2.0};
  EXPECT_EQ(camera.project({std::sin(1.84), 0.0, std::cos(1.84)}, px), ProjectionStatus::kFoldedBack);
  EXPECT_EQ(camera.project({0.0, 0.0, 0.0}, px), ProjectionStatus::kBehindCamera);
  EXPECT_EQ(camera.project({0.0, std::numeric_limits<double>::quiet_NaN(), 1.0}, px), ProjectionStatus::kNotFinite);
  EXPECT_EQ(px, Vector2d(1.0, 2.0)) << "untouched on failure";
  EXPECT_TRUE(camera.unproject({camera.cx + 1.21 * camera.fx, camera.cy}, ray));  // the largest is 1.2172
  ray = {1.0, 2.0, 3.0};
  EXPECT_FALSE(camera.unproject({camera.cx + 1.22 * camera.fx, camera.cy}, ray));
  EXPECT_EQ(ray, Vector3d(1.0, 2.0, 3.0)) << "untouched on failure";
}

}  // namespace
}  // namespace perimap
