// A simulated trial: points of a beating surface seen by a moving camera, with the truth, the phase and the data
// association known. What differs from a recording is only that nothing else than the estimator is tried.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "core/error/expected.hpp"
#include "core/estimation/measurement_model.hpp"
#include "core/periodic/basis.hpp"
#include "core/periodic/periodic_motion.hpp"
#include "drivers/standins/truth/heart_mesh.hpp"

namespace perimap {

using AnyModel = std::variant<BearingModel, PixelModel>;

enum class SceneSurface : std::uint8_t {
  kHeart,      // the epicardium from MRI; its motion has 4 harmonics
  kEllipsoid,  // beats by an affine map whose harmonics are drawn at random, falling with 1/k^2
  kPlate       // a patch before the camera that moves along the optical axis, 13 mm from end to end, 3 harmonics
};

// The tracker's error of the camera pose: the rotation's in the camera's axes, the centre's in W. RMS of 3-D norms.
// With a correlation time it is a Gauss-Markov process of the first order.
struct PoseError {
  double position_rms_mm = 0.0;
  double rotation_rms_rad = 0.0;
  double correlation_s = 0.0;

  [[nodiscard]] double position_variance_mm2() const noexcept { return position_rms_mm * position_rms_mm / 3.0; }
  [[nodiscard]] double rotation_variance_rad2() const noexcept { return rotation_rms_rad * rotation_rms_rad / 3.0; }
};

// Breathing moves all points alike by depth_mm sin^4(psi / 2) in a direction that is drawn for the trial, which is two
// harmonics of the respiratory phase psi (Lujan, Larsen, Balter & Ten Haken, Med. Phys. 26:715-720, 1999, n = 2). The
// zero of psi is drawn too: no sensor marks the end of the expiration.
struct SceneBreathing {
  double depth_mm = 0.0;   // from end to end; 0: the truth has no respiratory series
  double period_s = 4.0;   // mean length of a breath
  double deviation = 0.1;  // standard deviation of a breath's length as a share of the mean
};

struct SceneSettings {
  SceneSurface surface = SceneSurface::kEllipsoid;
  int ellipsoid_harmonics = 6;  // at most kMaxHarmonics
  bool bearings = false;        // else pixels, f = 700 px, 1280 x 720
  int features = 5;
  int frames = 600;
  int min_frames = 0;  // when > 0, each feature is seen in its first min_frames..frames frames only
  double frames_per_s = 30.0;
  double distance_mm = 90.0;  // from the camera's rest to the surface
  double deviation = 0.7;     // of each component of a match, px or rad
  double outliers = 0.0;      // fraction of matches that are 15 to 150 deviations off
  std::string ecg_record;     // rhythm of this MIT-BIH record; empty: 70/min, 3.9 % standard deviation
  PoseError pose_error;
  SceneBreathing breathing;
  double drift_per_min = 0.0;  // the motion's amplitude grows by this share of the first one a minute
  std::uint64_t seed = 1;
};

struct SceneFrame {
  double time_s = 0.0;
  double phase_rad = 0.0;
  double breath_rad = 0.0;  // respiratory phase; 0 without breathing
  Pose X_CW_true;           // into the model's camera frame: x forward for bearings
  Pose X_CW;                // as the tracker gives it

  [[nodiscard]] Basis basis(const BasisLayout& layout) const noexcept {
    return basis_at(layout, phase_rad, breath_rad);
  }
};

struct Sighting {
  int frame = 0;
  Vector2d z = Vector2d::Zero();
  bool outlier = false;
};

struct SceneFeature {
  StateVector x;  // of the truth's layout, at the beginning
  std::vector<Sighting> sightings;
};

struct Scene {
  SceneSettings settings;
  AnyModel model;
  BasisLayout layout;  // of the truth
  std::vector<SceneFrame> frames;
  std::vector<SceneFeature> features;
  Vector3d axis_W = Vector3d::UnitZ();  // from the camera's rest to the surface

  [[nodiscard]] Vector3d true_position(const SceneFeature& feature, double phase_rad,
                                       double breath_rad = 0.0) const noexcept {
    return position_of(feature.x, basis_at(layout, phase_rad, breath_rad));
  }
  [[nodiscard]] Vector3d true_position(const SceneFeature& feature, const SceneFrame& frame) const noexcept {
    return position_of(feature.x, frame.basis(layout));
  }
  // The feature as the drift of its amplitude leaves it at this time.
  [[nodiscard]] SceneFeature drifted(SceneFeature feature, double time_s) const;
  // Covariance of a match without pose noise.
  [[nodiscard]] Matrix2d match_covariance() const noexcept {
    return settings.deviation * settings.deviation * Matrix2d::Identity();
  }
};

// The epicardium that the program carries.
[[nodiscard]] Expected<HeartMesh> load_heart();

// `heart` is only read for SceneSurface::kHeart. The error names the ECG record that does not exist.
[[nodiscard]] Expected<Scene> make_scene(const SceneSettings& settings, const HeartMesh& heart);

}  // namespace perimap
