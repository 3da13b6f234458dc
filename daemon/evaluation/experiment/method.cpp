#include "daemon/evaluation/experiment/method.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace perimap {
namespace {

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();

const SceneFrame& frame_of(const Scene& scene, const Sighting& sighting) {
  return scene.frames[static_cast<std::size_t>(sighting.frame)];
}

// At `depth_mm` on the sighting's ray.
Vector3d on_ray(const Scene& scene, const Sighting& sighting, double depth_mm) {
  Vector3d ray_C = Vector3d::UnitZ();
  static_cast<void>(std::visit([&](const auto& model) { return model.ray(sighting.z, ray_C); }, scene.model));
  return frame_of(scene, sighting).X_CW.inverse() * (depth_mm * ray_C);
}

UpdateOutcome update(const Scene& scene, FeatureEstimate& estimate, const Observation& observation,
                     const UpdateSettings& settings) {
  return std::visit([&](const auto& model) { return iterated_update(estimate, observation, model, settings); },
                    scene.model);
}

BatchOutcome batch(const Scene& scene, const std::vector<Observation>& observations, const MethodSetting& setting,
                   const BatchSettings& settings) {
  return std::visit(
      [&](const auto& model) {
        return batch_start<std::decay_t<decltype(model)>>(observations, model, setting.layout, setting.prior, settings);
      },
      scene.model);
}

// A filter that starts on the first ray.
class RecursiveMethod final : public Method {
 public:
  RecursiveMethod(const MethodSetting& setting, const BasisLayout& layout, const UpdateSettings& settings)
      : setting_(setting), layout_(layout), settings_(settings) {}

  void observe(const Sighting& sighting) override {
    const Scene& scene = *setting_.scene;
    if (!estimate_)
      estimate_ = prior_estimate(layout_, setting_.prior, on_ray(scene, sighting, setting_.first_depth_mm));
    const Basis b = frame_of(scene, sighting).basis(layout_);
    const Observation observation = observation_of(scene, layout_, sighting, estimate_->position(b));
    last_innovation_ = update(scene, *estimate_, observation, settings_).innovation.norm();
  }
  const FeatureEstimate* estimate() override { return estimate_ ? &*estimate_ : nullptr; }
  [[nodiscard]] BasisLayout layout() const override { return layout_; }
  [[nodiscard]] double last_innovation() const override { return last_innovation_; }

 private:
  MethodSetting setting_;
  BasisLayout layout_;
  UpdateSettings settings_;
  std::optional<FeatureEstimate> estimate_;
  double last_innovation_ = kNoNumber;
};

BatchSettings batch_settings(double first_depth_mm, bool robust) {
  BatchSettings settings;
  settings.start_depths_mm = {50.0 / 90.0 * first_depth_mm, first_depth_mm, 160.0 / 90.0 * first_depth_mm};
  settings.prior_depth_mm = first_depth_mm;
  settings.robust = robust;
  return settings;
}

// The batch needs R beforehand, and pose noise enters it at the feature: supposed at the first depth, as perimapd's
// start does. `observations` are left for another solution.
BatchOutcome batch_of(const MethodSetting& setting, std::span<const Sighting> sightings, const BatchSettings& settings,
                      std::vector<Observation>& observations) {
  const Scene& scene = *setting.scene;
  const Vector3d guess = on_ray(scene, sightings.front(), setting.first_depth_mm);
  observations.clear();
  for (const Sighting& sighting : sightings)
    observations.push_back(observation_of(scene, setting.layout, sighting, guess));
  return batch(scene, observations, setting, settings);
}

class DelayedMethod final : public Method {
 public:
  DelayedMethod(const MethodSetting& setting, int buffered)
      : setting_(setting), wanted_(static_cast<std::size_t>(buffered)), buffered_(wanted_) {}

  void observe(const Sighting& sighting) override {
    const Scene& scene = *setting_.scene;
    if (!estimate_) {
      waiting_.push_back(sighting);
      if (waiting_.size() < wanted_) return;
      std::vector<Observation> observations;
      BatchOutcome outcome = batch_of(setting_, waiting_, batch_settings(setting_.first_depth_mm, true), observations);
      if (outcome.ok()) {
        estimate_ = std::move(outcome.estimate);
        waiting_.clear();
      } else {
        // Tried again when half as many more have come.
        wanted_ = waiting_.size() + buffered_ / 2;
      }
      return;
    }
    const Basis b = frame_of(scene, sighting).basis(setting_.layout);
    const Observation observation = observation_of(scene, setting_.layout, sighting, estimate_->position(b));
    last_innovation_ = update(scene, *estimate_, observation, {}).innovation.norm();
  }
  const FeatureEstimate* estimate() override { return estimate_ ? &*estimate_ : nullptr; }
  [[nodiscard]] BasisLayout layout() const override { return setting_.layout; }
  [[nodiscard]] double last_innovation() const override { return last_innovation_; }

 private:
  MethodSetting setting_;
  std::size_t wanted_;
  std::size_t buffered_;
  std::vector<Sighting> waiting_;
  std::optional<FeatureEstimate> estimate_;
  double last_innovation_ = kNoNumber;
};

class BatchMethod final : public Method {
 public:
  BatchMethod(const MethodSetting& setting, bool only_good) : setting_(setting), only_good_(only_good) {}

  void observe(const Sighting& sighting) override {
    if (only_good_ && sighting.outlier) return;
    sightings_.push_back(sighting);
    solved_ = false;
  }
  const FeatureEstimate* estimate() override {
    if (!solved_ && !sightings_.empty()) {
      solved_ = true;
      solve();
    }
    return outcome_.ok() ? &outcome_.estimate : nullptr;
  }
  [[nodiscard]] BasisLayout layout() const override { return setting_.layout; }
  [[nodiscard]] double last_innovation() const override { return kNoNumber; }

 private:
  // With pose noise twice: the first solution tells where the noise enters.
  void solve() {
    const BatchSettings settings = batch_settings(setting_.first_depth_mm, !only_good_);
    std::vector<Observation> observations;
    outcome_ = batch_of(setting_, sightings_, settings, observations);
    const Scene& scene = *setting_.scene;
    const PoseError& error = scene.settings.pose_error;
    if (!outcome_.ok() || (error.position_rms_mm == 0.0 && error.rotation_rms_rad == 0.0)) return;
    for (std::size_t k = 0; k < observations.size(); ++k) {
      observations[k] =
          observation_of(scene, setting_.layout, sightings_[k], outcome_.estimate.position(observations[k].b));
    }
    outcome_ = batch(scene, observations, setting_, settings);
  }

  MethodSetting setting_;
  bool only_good_;
  std::vector<Sighting> sightings_;
  BatchOutcome outcome_;
  bool solved_ = false;
};

// The paper does not gate: association is known.
UpdateSettings gauss_newton(int iterations, double step_factor) {
  UpdateSettings settings;
  settings.method = UpdateMethod::kGaussNewton;
  settings.max_iterations = iterations;
  settings.step_factor = step_factor;
  settings.tolerance = 0.0;
  settings.gate = std::numeric_limits<double>::infinity();
  if (iterations == 1) settings.covariance = CovarianceLinearisation::kLastStep;
  return settings;
}

}  // namespace

std::string method_name(MethodKind kind) {
  switch (kind) {
    case MethodKind::kStaticEkf:
      return "static EKF";
    case MethodKind::kFourierEkf:
      return "EKF, Fourier state";
    case MethodKind::kIterated:
      return "iterated, as the paper";
    case MethodKind::kDelayed:
      return "delayed start, LM";
    case MethodKind::kBatch:
      return "batch MAP";
  }
  return {};
}

std::unique_ptr<Method> make_method(MethodKind kind, const MethodSetting& setting, const MethodOptions& options) {
  switch (kind) {
    case MethodKind::kStaticEkf:
      return std::make_unique<RecursiveMethod>(setting, BasisLayout{0, 0}, gauss_newton(1, 1.0));
    case MethodKind::kFourierEkf:
      return std::make_unique<RecursiveMethod>(setting, setting.layout, gauss_newton(1, 1.0));
    case MethodKind::kIterated:
      return std::make_unique<RecursiveMethod>(setting, setting.layout,
                                               gauss_newton(options.paper_iterations, options.paper_step));
    case MethodKind::kDelayed:
      return std::make_unique<DelayedMethod>(setting, options.buffered);
    case MethodKind::kBatch:
      break;
  }
  return std::make_unique<BatchMethod>(setting, options.only_good);
}

Observation observation_of(const Scene& scene, const BasisLayout& layout, const Sighting& sighting,
                           const Vector3d& p_WF) {
  const SceneFrame& frame = frame_of(scene, sighting);
  Observation observation;
  observation.z = sighting.z;
  observation.R = scene.match_covariance();
  observation.b = frame.basis(layout);
  observation.X_CW = frame.X_CW;
  const PoseError& error = scene.settings.pose_error;
  if (error.position_rms_mm == 0.0 && error.rotation_rms_rad == 0.0) return observation;
  Vector2d z;
  MeasurementJacobians J;
  const ProjectionStatus status =
      std::visit([&](const auto& model) { return measure(model, frame.X_CW, p_WF, z, &J); }, scene.model);
  if (status == ProjectionStatus::kOk) {
    observation.R += pose_noise_covariance(J, error.position_variance_mm2() * Matrix3d::Identity(),
                                           error.rotation_variance_rad2() * Matrix3d::Identity());
  }
  return observation;
}

double true_first_depth_mm(const Scene& scene, const SceneFeature& feature) {
  const SceneFrame& frame = frame_of(scene, feature.sightings.front());
  return (frame.X_CW_true * scene.true_position(feature, frame)).norm();
}

}  // namespace perimap
