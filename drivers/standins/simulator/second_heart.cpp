#include "drivers/standins/simulator/second_heart.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {
namespace {

constexpr double kWholeTurn_rad = 2.0 * std::numbers::pi;
constexpr std::uint32_t kSecondHarmonics = 2;
constexpr std::uint32_t kHeartRings = 40;  // between the poles
constexpr std::uint32_t kHeartSpokes = 64;

struct Proportions {
  double half_length_mm, half_width_mm, half_depth_mm, egg, groove, groove_rad, twist_rad;
};

Proportions drawn_proportions(std::uint64_t seed) {
  const CounterNoise noise(seed, 7200);
  const double half_width_mm = noise.uniform(1, 30.0, 42.0);
  return {noise.uniform(0, 44.0, 56.0),
          half_width_mm,
          noise.uniform(2, 0.67, 0.9) * half_width_mm,
          noise.uniform(3, 0.15, 0.35),
          noise.uniform(4, 0.05, 0.12),
          noise.uniform(5, 0.0, kWholeTurn_rad),
          noise.uniform(6, 0.05, 0.15)};
}

// At a latitude (0 at the apex, pi at the base) and a longitude, at rest and at the height of systole.
std::array<Vector3d, 2> places_at(const Proportions& of, double latitude, double longitude) {
  const double up = -std::cos(latitude);
  // Wider towards the base, and drawn in along a great circle.
  const double beside = std::sin(longitude - of.groove_rad);
  const double wide = std::sin(latitude) * (1.0 + of.egg * up) * (1.0 - of.groove * std::exp(-8.0 * beside * beside));
  const auto place = [&](double length, double radius, double turn) {
    const double angle = longitude + turn;
    return Vector3d(of.half_width_mm * radius * wide * std::cos(angle),
                    of.half_depth_mm * radius * wide * std::sin(angle), of.half_length_mm * length * up);
  };
  return {place(1.0, 1.0, 0.0), place(0.88, 0.86, -of.twist_rad * up)};
}

}  // namespace

HeartMesh second_heart(std::uint64_t seed) {
  const Proportions of = drawn_proportions(seed);
  HeartMesh heart;
  heart.harmonics = kSecondHarmonics;
  const auto add = [&](double latitude, double longitude) {
    const auto [rest, systole] = places_at(of, latitude, longitude);
    // The share of systole is (1 - cos phi) / 2, steepened by a second harmonic.
    const Vector3d d = systole - rest;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (const double value : {rest[axis] + 0.5 * d[axis], -0.5 * d[axis], 0.0, 0.0, 0.1 * d[axis]}) {
        heart.coefficients_mm.push_back(value);
      }
    }
    return heart.vertex_count++;
  };
  const std::uint32_t apex = add(0.0, 0.0);
  for (std::uint32_t ring = 1; ring <= kHeartRings; ++ring) {
    for (std::uint32_t spoke = 0; spoke < kHeartSpokes; ++spoke) {
      add(std::numbers::pi * ring / (kHeartRings + 1), kWholeTurn_rad * spoke / kHeartSpokes);
    }
  }
  const std::uint32_t base = add(std::numbers::pi, 0.0);
  const auto at = [&](std::uint32_t ring, std::uint32_t spoke) {
    return apex + 1 + (ring - 1) * kHeartSpokes + spoke % kHeartSpokes;
  };
  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    for (const std::uint32_t vertex : {a, b, c}) heart.triangles.push_back(vertex);
  };
  for (std::uint32_t spoke = 0; spoke < kHeartSpokes; ++spoke) {
    triangle(apex, at(1, spoke + 1), at(1, spoke));
    for (std::uint32_t ring = 1; ring < kHeartRings; ++ring) {
      triangle(at(ring, spoke), at(ring, spoke + 1), at(ring + 1, spoke));
      triangle(at(ring, spoke + 1), at(ring + 1, spoke + 1), at(ring + 1, spoke));
    }
    triangle(base, at(kHeartRings, spoke), at(kHeartRings, spoke + 1));
  }
  return heart;
}

}  // namespace perimap
