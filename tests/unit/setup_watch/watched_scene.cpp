#include "watched_scene.hpp"

#include <cmath>
#include <random>

#include "core/angle/angle.hpp"

namespace perimap::watched_scene {
namespace {

constexpr double kDistance_mm = 90.0;
const Pose kHandEye{so3_exp({0.1, -0.2, 0.3}), {5.0, -8.0, 200.0}};  // X_SC

// Two sinusoids, the second half as large and of another period.
struct Sway {
  double amplitude, frequency_hz, phase_rad;
  [[nodiscard]] double at(double t_s) const {
    return amplitude *
           (std::sin(kTwoPi * frequency_hz * t_s + phase_rad) +
            0.5 * std::sin(kTwoPi * 0.57 * frequency_hz * t_s + 2.0 * phase_rad)) /
           1.5;
  }
};

class Path {
 public:
  Path(double scale, std::mt19937& random) : scale_(scale) {
    std::uniform_real_distribution<double> phase(0.0, kTwoPi), faster(0.95, 1.05);
    const double amplitudes[] = {33.0, 25.0, 12.0, 0.175, 4.0, 4.0};
    const double frequencies[] = {0.127, 0.0971, 0.0617, 0.0533, 0.0831, 0.0719};
    for (int i = 0; i < 6; ++i) sways_[i] = {amplitudes[i], frequencies[i] * faster(random), phase(random)};
  }

  // The camera looks near the origin of W from 90 mm above it.
  [[nodiscard]] Pose X_WC(double t_s) const {
    const Vector3d c =
        Vector3d(0, 0, -kDistance_mm) + scale_ * Vector3d(sways_[0].at(t_s), sways_[1].at(t_s), sways_[2].at(t_s));
    const Vector3d target = scale_ * Vector3d(sways_[4].at(t_s), sways_[5].at(t_s), 0.0);
    const Vector3d z = (target - c).normalized();
    const Vector3d x = Vector3d(0, 1, 0).cross(z).normalized();
    Matrix3d R;
    R << x, z.cross(x), z;
    return {R * so3_exp({0, 0, scale_ * sways_[3].at(t_s)}), c};
  }

 private:
  double scale_;
  Sway sways_[6]{};
};

StateVector drawn_motion(const BasisLayout& of, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> across(-22.0, 22.0);
  const int n = of.size();
  StateVector x = StateVector::Zero(3 * n);
  for (int axis = 0; axis < 3; ++axis) {
    x(axis * n) = axis < 2 ? across(random) : 6.0 * normal(random);
    for (int k = 1; k <= of.cardiac_harmonics; ++k) {
      x(axis * n + k) = 2.0 / (k * k) * normal(random);
      x(axis * n + of.cardiac_harmonics + k) = 2.0 / (k * k) * normal(random);
    }
  }
  return x;
}

}  // namespace

CameraModel camera() {
  CameraModel model;
  model.width = 640;
  model.height = 480;
  model.fx = model.fy = 500.0;
  model.cx = 320.0;
  model.cy = 240.0;
  return model;
}

BasisLayout layout(const Scene& scene) { return {scene.harmonics, 0}; }

WatchedWindow watch(const Scene& scene, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  // Each number by a statement of its own: in which order arguments are drawn is the compiler's choice.
  const auto normal_pair = [&] {
    const double y = normal(random), x = normal(random);
    return Vector2d(x, y);
  };
  const auto drawn = [&](double deviation) {
    const double z = normal(random), y = normal(random), x = normal(random);
    return Vector3d(deviation * Vector3d(x, y, z));
  };
  const BasisLayout of = layout(scene);
  const Path path(scene.sway, random);
  const CameraModel true_camera = corrected(camera(), scene.deviation);

  WatchedWindow window;
  std::vector<StateVector> truth;
  for (int i = 0; i < scene.features; ++i) {
    truth.push_back(drawn_motion(of, random));
    // What the map has is a little off.
    StateVector& map = window.features.emplace_back(truth.back());
    for (Eigen::Index m = 0; m < map.size(); ++m) map(m) += 0.3 * normal(random);
  }
  if (scene.correlation_told) window.error_correlation_s = scene.error_correlation_s;

  const double rate_hz = 1.1 + 0.2 * uniform(random);
  Vector3d turn = drawn(scene.rotation_deviation_rad), move = drawn(scene.position_deviation_mm);
  const double step_s = 1.0 / scene.frames_per_s;
  const double kept = scene.error_correlation_s > 0.0 ? std::exp(-step_s / scene.error_correlation_s) : 0.0;
  const double fresh = std::sqrt(1.0 - kept * kept);
  for (double t_s = 0.0; t_s < scene.seconds; t_s += step_s) {
    turn = kept * turn + fresh * drawn(scene.rotation_deviation_rad);
    move = kept * move + fresh * drawn(scene.position_deviation_mm);
    // The true camera was where the sensor's true pose at t + tau and the true hand-eye have it.
    const double tau_s = scene.deviation(kTimeAt);
    const Pose true_X_WC = path.X_WC(t_s);
    const auto configured_at = [&](double at_s) {
      const Pose D{so3_exp(scene.deviation.segment<3>(kTurnAt)), scene.deviation.segment<3>(kMoveAt)};
      return path.X_WC(at_s - tau_s) * D.inverse();
    };
    // As the tracker has it: the sensor's pose with its error, and the configured hand-eye.
    const Pose X_WS = configured_at(t_s) * kHandEye.inverse();
    const Pose told_X_WS{so3_exp(turn) * X_WS.R, X_WS.t + move};
    WatchedFrame& frame = window.frames.emplace_back();
    frame.t_s = t_s;
    frame.X_WC = told_X_WS * kHandEye;
    frame.lever_W_mm = told_X_WS.R * kHandEye.t;
    frame.position_variance_mm2 = scene.position_deviation_mm * scene.position_deviation_mm;
    frame.rotation_variance_rad2 = scene.rotation_deviation_rad * scene.rotation_deviation_rad;
    constexpr double kStep_s = 0.05;
    const Pose before = configured_at(t_s - kStep_s), now = configured_at(t_s), after = configured_at(t_s + kStep_s);
    frame.twist.turn_C_rad_per_s = so3_log(before.R.transpose() * after.R) / (2 * kStep_s);
    frame.twist.move_C_mm_per_s = now.R.transpose() * (after.t - before.t) / (2 * kStep_s);
    const double phase_rad = kTwoPi * rate_hz * (t_s + 0.05 * std::sin(t_s));
    frame.b = basis_at(of, phase_rad);
    frame.b_rate = basis_rate(of, phase_rad) * kTwoPi * rate_hz;
    for (int i = 0; i < scene.features; ++i) {
      Vector2d px;
      const Vector3d q = true_X_WC.inverse() * position_of(truth[static_cast<std::size_t>(i)], frame.b);
      if (true_camera.project(q, px) != ProjectionStatus::kOk || !true_camera.contains(px)) continue;
      px += scene.pixel_deviation_px * normal_pair();
      if (uniform(random) < scene.outliers) px += 30.0 * normal_pair();
      const double variance_px2 = std::max(1e-4, scene.pixel_deviation_px * scene.pixel_deviation_px);
      frame.matches.push_back({i, px, variance_px2 * Matrix2d::Identity()});
    }
  }
  return window;
}

}  // namespace perimap::watched_scene
