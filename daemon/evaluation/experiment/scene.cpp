#include "daemon/evaluation/experiment/scene.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/angle/angle.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/ecg_record.hpp"
#include "drivers/standins/simulator/embedded_data.hpp"
#include "drivers/standins/simulator/scope_path.hpp"
#include "drivers/standins/truth/heart_motion.hpp"

namespace perimap {
namespace {

// Independent sequences of random numbers; those of features come after the last, four each.
enum Stream : std::uint64_t {
  kRhythm = 1,
  kMotion,
  kPoseRotation,
  kPosePosition,
  kChoice,
  kBreathLength,
  kBreathMotion,
  kFeature = 16
};

Vector3d normal3(const CounterNoise& noise, std::uint64_t index) noexcept {
  return {noise.normal(3 * index), noise.normal(3 * index + 1), noise.normal(3 * index + 2)};
}

Expected<std::vector<Instant>> r_peaks(const SceneSettings& settings) {
  const CounterNoise noise(settings.seed, kRhythm);
  const double duration_s = settings.frames / settings.frames_per_s;
  std::vector<Instant> peaks;
  if (settings.ecg_record.empty()) {
    constexpr double kMean_s = 60.0 / 70.0;
    double t = -kMean_s * noise.uniform(0);
    for (std::uint64_t i = 1; t < duration_s + 2.0 * kMean_s; ++i) {
      peaks.emplace_back(from_seconds(t));
      t += kMean_s * (1.0 + 0.039 * std::clamp(noise.normal(i), -4.0, 4.0));
    }
    return peaks;
  }
  const auto record = load_ecg_record(settings.ecg_record);
  if (!record) return tl::unexpected(record.error());
  const auto& beats = record->beat_samples;
  const auto seconds = [&](std::uint32_t sample) { return sample / record->sample_rate_hz; };
  const double last_start = seconds(beats.back()) - duration_s - 3.0;
  if (last_start < seconds(beats.front())) {
    return fail("ECG record " + settings.ecg_record + " is too short for " + std::to_string(settings.frames) +
                " frames");
  }
  const double start = noise.uniform(0, seconds(beats.front()), last_start);
  for (const std::uint32_t beat : beats) {
    const double t = seconds(beat) - start;
    if (t > -3.0 && t < duration_s + 3.0) peaks.emplace_back(from_seconds(t));
  }
  return peaks;
}

// The respiratory phase of each frame: linear in each breath, whose lengths are drawn. Zero without breathing.
std::vector<double> breath_phases(const SceneSettings& settings) {
  std::vector<double> phases(static_cast<std::size_t>(settings.frames), 0.0);
  const SceneBreathing& breathing = settings.breathing;
  if (breathing.depth_mm == 0.0) return phases;
  const CounterNoise noise(settings.seed, kBreathLength);
  double begin_s = -breathing.period_s * noise.uniform(0);
  std::uint64_t breath = 1;
  const auto length_s = [&] {
    return breathing.period_s * (1.0 + breathing.deviation * std::clamp(noise.normal(breath), -4.0, 4.0));
  };
  for (std::size_t f = 0; f < phases.size(); ++f) {
    const double time_s = static_cast<double>(f) / settings.frames_per_s;
    while (time_s >= begin_s + length_s()) {
      begin_s += length_s();
      ++breath;
    }
    phases[f] = kTwoPi * (time_s - begin_s) / length_s();
  }
  return phases;
}

// Where the camera looks from, and what moves before it.
struct Stage {
  BasisLayout layout;
  Vector3d target_W;                    // of the surface, below the camera's rest
  Vector3d axis_W = Vector3d::UnitZ();  // from the camera's rest to the target
  Vector3d up_W = -Vector3d::UnitY();
  std::vector<StateVector> points;
};

Stage heart_stage(const SceneSettings& settings, const HeartMesh& heart) {
  Stage stage;
  stage.layout = {static_cast<int>(heart.harmonics), 0};
  // The anterior and left lateral wall; the frame is the table's (x left, y posterior, z superior).
  stage.axis_W = -Vector3d(0.45, -0.80, -0.38).normalized();
  stage.up_W = Vector3d::UnitZ();
  const Eigen::Index n = stage.layout.size();
  const auto coefficients = [&](std::uint32_t vertex) {
    return StateVector(
        Eigen::Map<const Eigen::VectorXd>(heart.coefficients_mm.data() + 3 * n * Eigen::Index{vertex}, 3 * n));
  };
  const auto mean = [&](const StateVector& x) { return Vector3d(x(0), x(n), x(2 * n)); };
  double nearest = 1e300;
  for (std::uint32_t vertex = 0; vertex < heart.vertex_count; ++vertex) {
    const Vector3d p = mean(coefficients(vertex));
    if (p.dot(stage.axis_W) < nearest) {
      nearest = p.dot(stage.axis_W);
      stage.target_W = p;
    }
  }
  std::vector<StateVector> candidates;
  constexpr double kRadius_mm = 35.0;
  for (std::uint32_t vertex = 0; vertex < heart.vertex_count; ++vertex) {
    StateVector x = coefficients(vertex);
    if ((mean(x) - stage.target_W).norm() < kRadius_mm) candidates.push_back(std::move(x));
  }
  const CounterNoise noise(settings.seed, kChoice);
  for (int i = 0; i < settings.features; ++i) {
    const double pick = noise.uniform(static_cast<std::uint64_t>(i)) * static_cast<double>(candidates.size());
    stage.points.push_back(candidates[static_cast<std::size_t>(pick)]);
  }
  return stage;
}

Stage ellipsoid_stage(const SceneSettings& settings) {
  Stage stage;
  const int H = settings.ellipsoid_harmonics;
  stage.layout = {H, 0};
  const Vector3d axes_mm(45.0, 35.0, 35.0);
  stage.target_W = Vector3d(0.0, 0.0, -axes_mm.z());
  // Harmonic k moves p by Q p + t; half of the variance (4 / k^2 mm)^2 of each coefficient comes from either term.
  const CounterNoise motion(settings.seed, kMotion);
  constexpr double kFirst_mm = 4.0 / std::numbers::sqrt2;
  const double mean_radius_mm = 40.0;
  const CounterNoise choice(settings.seed, kChoice);
  const int n = stage.layout.size();
  for (int i = 0; i < settings.features; ++i) {
    const auto at = 2 * static_cast<std::uint64_t>(i);
    const double u = choice.uniform(at, -0.6, 0.6);
    const double v = choice.uniform(at + 1, -0.6, 0.6);
    const Vector3d p(axes_mm.x() * std::sin(u) * std::cos(v), axes_mm.y() * std::sin(v),
                     -axes_mm.z() * std::cos(u) * std::cos(v));
    StateVector x = StateVector::Zero(3 * n);
    for (int axis = 0; axis < 3; ++axis) x(axis * n) = p(axis);
    std::uint64_t index = 0;
    for (int part = 0; part < 2; ++part) {
      for (int k = 1; k <= H; ++k) {
        const Vector3d t = normal3(motion, index++);
        Matrix3d Q;
        for (int row = 0; row < 3; ++row) Q.row(row) = normal3(motion, index++).transpose();
        const Vector3d a = kFirst_mm / (k * k) * (t + Q * p / mean_radius_mm);
        for (int axis = 0; axis < 3; ++axis) x(axis * n + part * H + k) = a(axis);
      }
    }
    stage.points.push_back(std::move(x));
  }
  return stage;
}

Stage plate_stage(const SceneSettings& settings) {
  Stage stage;
  constexpr int kHarmonics = 3;
  stage.layout = {kHarmonics, 0};
  stage.target_W = Vector3d::Zero();
  // A steep rise and a slow fall, 13 mm from end to end.
  const double along_mm[] = {0.0, 4.8, 1.6, 0.5, 3.2, 1.9, 0.9};
  double low = 1e300;
  double high = -1e300;
  for (int i = 0; i < 360; ++i) {
    const Basis b = basis_at(stage.layout, kTwoPi * i / 360.0);
    double s = 0.0;
    for (int j = 0; j < b.size(); ++j) s += along_mm[j] * b(j);
    low = std::min(low, s);
    high = std::max(high, s);
  }
  const double scale = 13.0 / (high - low);
  const CounterNoise choice(settings.seed, kChoice);
  const int n = stage.layout.size();
  for (int i = 0; i < settings.features; ++i) {
    const auto at = 3 * static_cast<std::uint64_t>(i);
    StateVector x = StateVector::Zero(3 * n);
    x(0) = choice.uniform(at, -28.0, 28.0);
    x(n) = choice.uniform(at + 1, -18.0, 18.0);
    x(2 * n) = choice.uniform(at + 2, -4.0, 4.0);
    for (int j = 1; j < n; ++j) x(2 * n + j) = scale * along_mm[j];
    stage.points.push_back(std::move(x));
  }
  return stage;
}

// Appends the respiratory series to every point: sin^4(psi / 2) = 3/8 - 1/2 cos psi + 1/8 cos 2 psi, its zero shifted.
void breathe(const SceneSettings& settings, Stage& stage) {
  constexpr double kMean = 0.375;
  constexpr double kHarmonics[] = {-0.5, 0.125};
  const CounterNoise noise(settings.seed, kBreathMotion);
  const Vector3d displacement_mm = settings.breathing.depth_mm * normal3(noise, 0).normalized();
  const double shift_rad = noise.uniform(3, 0.0, kTwoPi);
  const BasisLayout still = stage.layout;
  stage.layout.respiratory_harmonics = static_cast<int>(std::size(kHarmonics));
  const int n = stage.layout.size();
  for (StateVector& point : stage.points) {
    StateVector x = StateVector::Zero(3 * n);
    for (int axis = 0; axis < 3; ++axis) {
      x.segment(axis * n, still.size()) = point.segment(axis * still.size(), still.size());
      x(axis * n) += kMean * displacement_mm(axis);
      for (int k = 1; k <= stage.layout.respiratory_harmonics; ++k) {
        // cos k (psi + shift) in the basis [cos k psi, -sin k psi].
        const double amplitude_mm = kHarmonics[k - 1] * displacement_mm(axis);
        const int cosine = axis * n + still.size() - 1 + k;
        x(cosine) = amplitude_mm * std::cos(k * shift_rad);
        x(cosine + stage.layout.respiratory_harmonics) = amplitude_mm * std::sin(k * shift_rad);
      }
    }
    point = x;
  }
}

Stage stage_of(const SceneSettings& settings, const HeartMesh& heart) {
  switch (settings.surface) {
    case SceneSurface::kHeart:
      return heart_stage(settings, heart);
    case SceneSurface::kPlate:
      return plate_stage(settings);
    case SceneSurface::kEllipsoid:
      break;
  }
  return ellipsoid_stage(settings);
}

Stage make_stage(const SceneSettings& settings, const HeartMesh& heart) {
  Stage stage = stage_of(settings, heart);
  if (settings.breathing.depth_mm > 0.0) breathe(settings, stage);
  return stage;
}

// C as everywhere into the camera frame of bearings: x forward, y left, z up.
Pose forward_first() noexcept {
  Matrix3d R;
  R << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  return {R, Vector3d::Zero()};
}

std::vector<SceneFrame> make_frames(const SceneSettings& settings, const Stage& stage, const HeartMotion& motion) {
  const ScopePath path(settings.seed, stage.target_W - settings.distance_mm * stage.axis_W, stage.target_W, stage.up_W);
  const PoseError& error = settings.pose_error;
  const CounterNoise rotation_noise(settings.seed, kPoseRotation);
  const CounterNoise position_noise(settings.seed, kPosePosition);
  const double rotation = std::sqrt(error.rotation_variance_rad2());
  const double position = std::sqrt(error.position_variance_mm2());
  const double keep = error.correlation_s > 0.0 ? std::exp(-1.0 / (settings.frames_per_s * error.correlation_s)) : 0.0;
  Vector3d theta = Vector3d::Zero();
  Vector3d delta_c = Vector3d::Zero();
  const std::vector<double> breaths = breath_phases(settings);
  std::vector<SceneFrame> frames(static_cast<std::size_t>(settings.frames));
  for (std::size_t f = 0; f < frames.size(); ++f) {
    SceneFrame& frame = frames[f];
    frame.time_s = static_cast<double>(f) / settings.frames_per_s;
    const Duration t = from_seconds(frame.time_s);
    frame.phase_rad = motion_phase(motion, Instant(t)).phase_rad;
    frame.breath_rad = breaths[f];
    frame.X_CW_true = path.X_WC(t).inverse();
    if (settings.bearings) frame.X_CW_true = forward_first() * frame.X_CW_true;
    // Stationary from the first frame on.
    const double drive = f == 0 ? 1.0 : std::sqrt(1.0 - keep * keep);
    theta = (f == 0 ? 0.0 : keep) * theta + drive * rotation * normal3(rotation_noise, f);
    delta_c = (f == 0 ? 0.0 : keep) * delta_c + drive * position * normal3(position_noise, f);
    const Matrix3d R = so3_exp(theta) * frame.X_CW_true.R;
    const Vector3d c = -(frame.X_CW_true.R.transpose() * frame.X_CW_true.t) + delta_c;
    frame.X_CW = {R, -(R * c)};
  }
  return frames;
}

// All but the mean of each axis grows.
StateVector drifted_motion(StateVector x, const BasisLayout& layout, double drift_per_min, double time_s) {
  const double factor = 1.0 + drift_per_min * time_s / 60.0;
  for (int axis = 0; axis < 3; ++axis) x.segment(axis * layout.size() + 1, layout.size() - 1) *= factor;
  return x;
}

template <class Model>
std::vector<Sighting> sightings_of(const SceneSettings& settings, const Model& model, const Stage& stage,
                                   const std::vector<SceneFrame>& frames, std::size_t index) {
  const CounterNoise noise(settings.seed, kFeature + 4 * index);
  const CounterNoise chance(settings.seed, kFeature + 4 * index + 1);
  const CounterNoise size(settings.seed, kFeature + 4 * index + 2);
  std::size_t seen_frames = frames.size();
  if (settings.min_frames > 0) {
    const CounterNoise life(settings.seed, kFeature + 4 * index + 3);
    seen_frames = static_cast<std::size_t>(life.uniform(0, settings.min_frames, settings.frames));
  }
  std::vector<Sighting> sightings;
  for (std::size_t f = 0; f < std::min(seen_frames, frames.size()); ++f) {
    const StateVector x = drifted_motion(stage.points[index], stage.layout, settings.drift_per_min, frames[f].time_s);
    const Vector3d p = position_of(x, frames[f].basis(stage.layout));
    Sighting sighting;
    sighting.frame = static_cast<int>(f);
    if (model.predict(frames[f].X_CW_true * p, sighting.z) != ProjectionStatus::kOk) continue;
    if constexpr (std::is_same_v<Model, PixelModel>) {
      if (!model.camera.contains(sighting.z)) continue;
    }
    sighting.z += settings.deviation * Vector2d(noise.normal(2 * f), noise.normal(2 * f + 1));
    sighting.outlier = chance.uniform(f) < settings.outliers;
    if (sighting.outlier) {
      const double length = settings.deviation * size.uniform(2 * f, 15.0, 150.0);
      const double angle = size.uniform(2 * f + 1, 0.0, kTwoPi);
      sighting.z += length * Vector2d(std::cos(angle), std::sin(angle));
    }
    sightings.push_back(sighting);
  }
  return sightings;
}

}  // namespace

SceneFeature Scene::drifted(SceneFeature feature, double time_s) const {
  feature.x = drifted_motion(feature.x, layout, settings.drift_per_min, time_s);
  return feature;
}

Expected<HeartMesh> load_heart() {
  return parse_heart_mesh(embedded_epicardium_fourier_csv(), embedded_epicardium_faces_csv());
}

Expected<Scene> make_scene(const SceneSettings& settings, const HeartMesh& heart) {
  HeartMotion motion;
  auto peaks = r_peaks(settings);
  if (!peaks) return tl::unexpected(peaks.error());
  motion.r_peaks = *std::move(peaks);
  const Stage stage = make_stage(settings, heart);
  Scene scene;
  scene.settings = settings;
  scene.layout = stage.layout;
  scene.axis_W = stage.axis_W;
  if (settings.bearings) {
    scene.model = BearingModel{};
  } else {
    scene.model =
        PixelModel{CameraModel{.width = 1280, .height = 720, .fx = 700.0, .fy = 700.0, .cx = 639.5, .cy = 359.5}};
  }
  scene.frames = make_frames(settings, stage, motion);
  for (std::size_t i = 0; i < stage.points.size(); ++i) {
    scene.features.push_back(
        {stage.points[i],
         std::visit([&](const auto& model) { return sightings_of(settings, model, stage, scene.frames, i); },
                    scene.model)});
  }
  return scene;
}

}  // namespace perimap
