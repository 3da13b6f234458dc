#include "core/pipeline/parallax.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace perimap {
namespace {

constexpr double kNoise_mm = 1.4;

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

}  // namespace
}  // namespace perimap
