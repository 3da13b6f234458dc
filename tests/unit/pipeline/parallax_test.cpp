#include "core/pipeline/parallax.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace perimap {
namespace {

constexpr double kNoise_mm = 1.4;

// Of a camera that sways by so much along an axis, as the tracker tells it.
CameraPose pose_at(double t_s, double sway_mm, double noise_mm, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, 1.0);
  const auto off_mm = [&] { return noise_mm * noise(random); };
  CameraPose pose;
  pose.state = CameraPose::State::kInterpolated;
  pose.position_variance_mm2 = noise_mm * noise_mm;
  pose.X_WC.t = Vector3d(sway_mm * std::sin(2.0 * t_s) + off_mm(), off_mm(), 50 + off_mm());
  return pose;
}

// So many seconds of a camera at 30 frames/s that sways by so much along an axis.
void watch(Parallax& parallax, double from_s, double seconds, double sway_mm, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, kNoise_mm);
  for (int i = 0; i < 30 * seconds; ++i) {
    const double t_s = from_s + i / 30.0;
    CameraPose pose;
    pose.state = CameraPose::State::kInterpolated;
    pose.position_variance_mm2 = kNoise_mm * kNoise_mm;
    pose.X_WC.t = Vector3d(sway_mm * std::sin(2.0 * t_s) + noise(random), noise(random), 50 + noise(random));
    parallax.add(pose, Instant(from_seconds(t_s)));
  }
}

TEST(Parallax, IsNoneWhileTheCameraStandsWhateverTheTrackersNoise) {
  std::mt19937 random(1);
  Parallax parallax;
  EXPECT_FALSE(parallax.none());
  watch(parallax, 10, 2, 0, random);
  EXPECT_FALSE(parallax.none()) << "too soon to tell";
  watch(parallax, 12, 10, 0, random);
  EXPECT_TRUE(parallax.none());
  EXPECT_FALSE(parallax.ever());
}

TEST(Parallax, IsThereWhereTheCameraSways) {
  std::mt19937 random(2);
  Parallax parallax;
  watch(parallax, 10, 20, 5, random);
  EXPECT_FALSE(parallax.none());
  watch(parallax, 30, 25, 0, random);
  EXPECT_TRUE(parallax.none()) << "it has stopped";
  EXPECT_TRUE(parallax.ever());
}

TEST(SeenFromAside, IsNotKnownWhileTheCameraStandsWhateverTheTrackersNoise) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    SeenFromAside aside;
    for (int i = 0; i < 3000; ++i) aside.add(pose_at(i / 30.0, 0, seed % 2 == 0 ? kNoise_mm : 0, random));
    EXPECT_FALSE(aside.known()) << seed;
  }
}

TEST(SeenFromAside, IsKnownWhereTheCameraSwaysAndStaysSo) {
  for (const double noise_mm : {0.0, kNoise_mm}) {
    std::mt19937 random(3);
    SeenFromAside aside;
    int i = 0;
    for (; i < 150; ++i) aside.add(pose_at(i / 30.0, 5, noise_mm, random));
    EXPECT_TRUE(aside.known());
    for (; i < 30000; ++i) aside.add(pose_at(i / 30.0, 0, noise_mm, random));
    EXPECT_TRUE(aside.known());
  }
}

TEST(SeenFromAside, IsNotKnownByPosesThatAreMissing) {
  std::mt19937 random(4);
  SeenFromAside aside;
  for (int i = 0; i < 300; ++i) {
    CameraPose pose = pose_at(i / 30.0, 5, 0, random);
    pose.state = CameraPose::State::kMissing;
    aside.add(pose);
  }
  EXPECT_FALSE(aside.known());
  EXPECT_TRUE(SeenFromAside(true).known()) << "told";
}

}  // namespace
}  // namespace perimap
