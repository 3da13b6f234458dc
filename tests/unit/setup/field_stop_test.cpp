// core/calibration/field_stop: the circle and its notch, drawn here by areas and not as the simulator draws them.
#include "core/calibration/field_stop.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

using testing::HasSubstr;

struct Drawn {
  int width = 640;
  int height = 480;
  Vector2d centre{325.0, 236.0};
  double radius = 215.0;
  double notch_rad = 0.7;
  double notch_depth = 14.0;
  double notch_half_rad = 0.045;
  double noise = 4.0;
  bool flat = false;
};

// Each pixel by sixteen places in it; the picture is brighter in its middle and has dark spots, as tissue has.
std::vector<std::uint8_t> picture_of(const Drawn& d, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> noise(0.0, d.noise);
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < d.height; ++y) {
    for (int x = 0; x < d.width; ++x) {
      const double distance = (Vector2d(x, y) - d.centre).norm() - d.radius;
      const bool at_edge = std::abs(distance) < d.notch_depth + 3.0;
      double light = at_edge ? 0.0 : d.flat || distance < 0.0 ? 1.0 : 0.0;
      for (int k = 0; at_edge && k < 16; ++k) {
        const Vector2d p(x + (k % 4 - 1.5) / 4.0, y + (k / 4 - 1.5) / 4.0);
        const Vector2d from = p - d.centre;
        const double r = from.norm();
        const double turn =
            std::abs(std::remainder(std::atan2(from.y(), from.x()) - d.notch_rad, 2.0 * std::numbers::pi));
        const double notch = d.notch_depth * std::max(0.0, 1.0 - turn / d.notch_half_rad);
        if (d.flat || r < d.radius - notch) light += 1.0 / 16.0;
      }
      const double scene =
          120.0 - 0.0006 * (Vector2d(x, y) - d.centre).squaredNorm() + 25.0 * std::sin(0.05 * x) * std::sin(0.037 * y);
      pixels.push_back(static_cast<std::uint8_t>(std::clamp(8.0 + light * scene + noise(generator), 0.0, 255.0)));
    }
  }
  return pixels;
}

Expected<FieldStopReading> read(const Drawn& d, std::uint64_t seed = 1) {
  const auto pixels = picture_of(d, seed);
  return read_field_stop({pixels.data(), d.width, d.height, d.width});
}

double turned_apart(double a, double b) { return std::remainder(a - b, 2.0 * std::numbers::pi); }

TEST(FieldStop, CircleAndNotchAreReadFromThePicture) {
  const Drawn drawn;
  const auto reading = read(drawn);
  ASSERT_TRUE(reading) << reading.error().message;
  EXPECT_LT((reading->centre_px - drawn.centre).norm(), 0.5);
  EXPECT_NEAR(reading->radius_px, drawn.radius, 1.0);
  EXPECT_LT(std::abs(turned_apart(reading->notch_rad, drawn.notch_rad)), 0.3 * kDegree);
  EXPECT_GT(reading->seen_share, 0.9);
}

TEST(FieldStop, TurnsAreKnownWithinHalfADegreeAndAsWellAsIsTold) {
  std::mt19937_64 generator(51297);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  constexpr int kTrials = 200;
  int far = 0;
  double nees = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Drawn drawn;
    drawn.centre += 12.0 * Vector2d(uniform(generator), uniform(generator));
    drawn.radius = 205.0 + 12.0 * uniform(generator);
    drawn.notch_rad = std::numbers::pi * uniform(generator);
    drawn.notch_depth = 13.0 + 5.0 * uniform(generator);
    drawn.noise = 4.0 + 2.0 * uniform(generator);
    const auto reading = read(drawn, 5000U + static_cast<std::uint64_t>(trial));
    ASSERT_TRUE(reading) << trial << ": " << reading.error().message;
    const double error = turned_apart(reading->notch_rad, drawn.notch_rad);
    if (std::abs(error) > 0.5 * kDegree) ++far;
    nees += error * error / (reading->notch_deviation_rad * reading->notch_deviation_rad) / kTrials;
  }
  EXPECT_LE(far, kTrials / 20);  // 95 %
  EXPECT_GT(nees, 0.8);          // of 200: 0.80 to 1.20 by chance (95 %)
  EXPECT_LT(nees, 1.2);
}

TEST(FieldStop, CircleCutOffByThePictureIsReadByWhatIsLeft) {
  Drawn drawn;
  drawn.radius = 270.0;
  drawn.notch_rad = 0.1;
  const auto reading = read(drawn);
  ASSERT_TRUE(reading) << reading.error().message;
  EXPECT_LT(reading->seen_share, 0.7);
  EXPECT_LT(std::abs(turned_apart(reading->notch_rad, drawn.notch_rad)), 0.5 * kDegree);
}

TEST(FieldStop, WhatIsMissingIsSaid) {
  Drawn none;
  none.flat = true;
  EXPECT_THAT(read(none).error().message, HasSubstr("no field stop is seen"));
  Drawn whole;
  whole.notch_depth = 0.0;
  EXPECT_THAT(read(whole).error().message, HasSubstr("no notch"));
  const std::vector<std::uint8_t> black(640 * 480, 3);
  EXPECT_THAT(read_field_stop({black.data(), 640, 480, 640}).error().message, HasSubstr("no field stop is seen"));
}

}  // namespace
}  // namespace perimap
