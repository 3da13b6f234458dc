// A smooth organ that moves, and features on it whose errors are drawn from the covariances that they claim.
#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "core/surface/periodic_surface.hpp"

namespace perimap::test {

inline constexpr BasisLayout kLayout{4, 0};

// A ball of 100 mm whose nearest point is 90 mm before the camera, which is at the origin and looks along z.
struct MadeOrgan {
  static Vector3d mean_place(const Vector2d& s) {
    constexpr double kRadius_mm = 100.0;
    constexpr double kNearest_mm = 90.0;
    const Vector3d ray = Vector3d(s.x() / kNearest_mm, s.y() / kNearest_mm, 1.0);
    const Vector3d centre(0.0, 0.0, kNearest_mm + kRadius_mm);
    const double a = ray.squaredNorm();
    const double b = ray.dot(centre);
    const double c = centre.squaredNorm() - kRadius_mm * kRadius_mm;
    return (b - std::sqrt(b * b - a * c)) / a * ray;
  }
  // Rows x, y, z; columns of the basis.
  static Eigen::Matrix3Xd coefficients(const Vector2d& s) {
    Eigen::Matrix3Xd c = Eigen::Matrix3Xd::Zero(3, kLayout.size());
    c.col(0) = mean_place(s);
    for (int k = 1; k <= kLayout.cardiac_harmonics; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        const double place = s.x() / 35.0 + s.y() / 45.0;
        c(axis, k) = 2.0 / (k * k) * std::cos(place + axis + 0.7 * k);
        c(axis, kLayout.cardiac_harmonics + k) = 1.5 / (k * k) * std::sin(0.8 * place - 2.0 * axis + k);
      }
    }
    return c;
  }
};

inline StateVector state_of(const Eigen::Matrix3Xd& coefficients) {
  StateVector x(3 * coefficients.cols());
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    x.segment(axis * coefficients.cols(), coefficients.cols()) = coefficients.row(axis).transpose();
  }
  return x;
}

// Depth is known half as well as the rest.
inline SurfaceEvidence evidence_at(std::uint32_t id, const Vector2d& s, double deviation_mm, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  SurfaceEvidence evidence;
  evidence.id = id;
  const Vector3d deviations(deviation_mm, deviation_mm, 2.0 * deviation_mm);
  evidence.mean_mm2 = deviations.cwiseAbs2().asDiagonal();
  evidence.bands_mm2.fill(0.25 * evidence.mean_mm2);
  Eigen::Matrix3Xd c = MadeOrgan::coefficients(s);
  for (Eigen::Index j = 0; j < c.cols(); ++j) {
    const double share = j == 0 ? 1.0 : 0.5;
    for (int axis = 0; axis < 3; ++axis) c(axis, j) += share * deviations(axis) * normal(random);
  }
  evidence.x = state_of(c);
  return evidence;
}

// Places at random within `radius_mm` of the axis, none nearer than `apart_mm` to another, and none in the hole.
inline std::vector<Vector2d> places_on_disc(std::size_t count, double radius_mm, double apart_mm,
                                            std::mt19937_64& random, double hole_mm = 0.0) {
  std::uniform_real_distribution<double> uniform(-radius_mm, radius_mm);
  std::vector<Vector2d> places;
  while (places.size() < count) {
    const Vector2d s(uniform(random), uniform(random));
    if (s.norm() > radius_mm || s.norm() < hole_mm) continue;
    const bool near =
        std::any_of(places.begin(), places.end(), [&](const Vector2d& other) { return (other - s).norm() < apart_mm; });
    if (!near) places.push_back(s);
  }
  return places;
}

inline std::vector<SurfaceEvidence> evidence_on(const std::vector<Vector2d>& places, double deviation_mm,
                                                std::mt19937_64& random) {
  std::vector<SurfaceEvidence> evidence;
  for (const Vector2d& s : places) {
    evidence.push_back(evidence_at(static_cast<std::uint32_t>(evidence.size() + 1), s, deviation_mm, random));
  }
  return evidence;
}

inline Matrix3d covariance_of(const PredictedPlaces& places, Eigen::Index v) {
  const auto c = places.covariances_W_mm2.col(v);
  Matrix3d covariance;
  covariance << c(0), c(1), c(2), c(1), c(3), c(4), c(2), c(4), c(5);
  return covariance;
}

// Where the chart has the organ's places.
inline std::vector<Vector2d> charted(const SurfaceChart& chart, const std::vector<Vector2d>& places) {
  std::vector<Vector2d> there;
  for (const Vector2d& s : places) there.push_back(chart.place_of(MadeOrgan::mean_place(s)).s);
  return there;
}

}  // namespace perimap::test
