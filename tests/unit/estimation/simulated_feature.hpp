// A beating point seen by a moving camera, as observations with known truth.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/estimation/feature_estimate.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/estimation/observation.hpp"

namespace perimap::test {

inline const PixelModel kPixelModel{
    CameraModel{.width = 1280, .height = 720, .fx = 700.0, .fy = 700.0, .cx = 640.0, .cy = 360.0}};
inline const PixelModel kFisheye{CameraModel{.width = 800,
                                             .height = 800,
                                             .fx = 300.0,
                                             .fy = 305.0,
                                             .cx = 400.0,
                                             .cy = 390.0,
                                             .k1 = 0.05,
                                             .k2 = 0.01,
                                             .k3 = -0.004,
                                             .k4 = 0.0008,
                                             .lens = Lens::kKannalaBrandt}};
inline constexpr double kPixelDeviation = 0.7;
inline constexpr double kBearingDeviation = 0.2 * std::numbers::pi / 180.0;

struct SimulatedFeature {
  StateVector x_true;
  std::vector<Observation> observations;
};

// The camera hovers 90 mm before the surface and wanders with an amplitude of 20 mm, always looking at the origin.
inline Pose camera_pose(double t, bool x_forward, double start) {
  const Vector3d c(20.0 * std::sin(0.9 * t + start), 20.0 * std::cos(0.7 * t + 2.0 * start),
                   -90.0 + 8.0 * std::sin(0.5 * t + 3.0 * start));
  const Vector3d forward = -c.normalized();
  const Vector3d right = Vector3d::UnitY().cross(forward).normalized();
  const Vector3d down = forward.cross(right);
  Matrix3d R;
  if (x_forward) {
    R << forward.transpose(), -right.transpose(), -down.transpose();
  } else {
    R << right.transpose(), down.transpose(), forward.transpose();
  }
  return {R, -(R * c)};
}

// `count` observations at 30 fps, heart rate 70/min; truth drawn from the prior around the surface. Outliers (a
// fraction) are 15 to 150 deviations off.
template <class Model, class Generator>
SimulatedFeature simulate_feature(const Model& model, const BasisLayout& layout, const Prior& prior, int count,
                                  double deviation, double outlier_fraction, Generator& generator) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  SimulatedFeature feature;
  const int n = layout.size();
  const Basis deviations = prior_deviations(layout, prior);
  feature.x_true.resize(3 * n);
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 1; i < n; ++i) feature.x_true(axis * n + i) = deviations(i) * normal(generator);
  }
  feature.x_true(0) = 40.0 * uniform(generator) - 20.0;
  feature.x_true(n) = 30.0 * uniform(generator) - 15.0;
  feature.x_true(2 * n) = 30.0 * uniform(generator) - 15.0;
  const double start = 6.28 * uniform(generator);
  double cycle_s = 60.0 / 70.0;
  double phase = 6.28 * uniform(generator);
  for (int k = 0; k < count; ++k) {
    Observation observation;
    observation.X_CW = camera_pose(k / 30.0, std::is_same_v<Model, BearingModel>, start);
    observation.b = basis_at(layout, phase, 1.4 * k / 30.0);
    observation.R = deviation * deviation * Matrix2d::Identity();
    Vector2d z;
    if (model.predict(observation.X_CW * position_of(feature.x_true, observation.b), z) != ProjectionStatus::kOk) {
      std::abort();
    }
    observation.z = z + deviation * Vector2d(normal(generator), normal(generator));
    if (uniform(generator) < outlier_fraction) {
      const double length = deviation * (15.0 + 135.0 * uniform(generator));
      const double angle = 6.28 * uniform(generator);
      observation.z += length * Vector2d(std::cos(angle), std::sin(angle));
    }
    feature.observations.push_back(observation);
    phase += 2.0 * std::numbers::pi / (30.0 * cycle_s);
    if (phase > 2.0 * std::numbers::pi) {
      phase -= 2.0 * std::numbers::pi;
      cycle_s = 60.0 / 70.0 * (1.0 + 0.039 * normal(generator));
    }
  }
  return feature;
}

constexpr int kCheckedPhases = 24;

// RMS over the cycle of |p^ - p| (mm).
inline double path_error(const StateVector& x, const StateVector& x_true, const BasisLayout& layout) {
  double sum = 0.0;
  for (int i = 0; i < kCheckedPhases; ++i) {
    const Basis b = basis_at(layout, 2.0 * std::numbers::pi * i / kCheckedPhases);
    sum += (position_of(x, b) - position_of(x_true, b)).squaredNorm();
  }
  return std::sqrt(sum / kCheckedPhases);
}

// The same from a covariance: the RMS error it promises.
inline double path_deviation(const FeatureEstimate& estimate, const BasisLayout& layout) {
  double sum = 0.0;
  for (int i = 0; i < kCheckedPhases; ++i) {
    sum += estimate.position_covariance(basis_at(layout, 2.0 * std::numbers::pi * i / kCheckedPhases)).trace();
  }
  return std::sqrt(sum / kCheckedPhases);
}

}  // namespace perimap::test
