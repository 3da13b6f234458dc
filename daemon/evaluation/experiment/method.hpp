// The estimators that the experiments compare, behind one interface: each follows one feature.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/estimation/batch_start.hpp"
#include "core/estimation/feature_estimate.hpp"
#include "core/estimation/iterated_update.hpp"
#include "daemon/evaluation/experiment/scene.hpp"

namespace perimap {

// What a method may know of a feature beforehand.
struct MethodSetting {
  const Scene* scene = nullptr;
  BasisLayout layout;
  Prior prior;
  double first_depth_mm = 90.0;  // where the feature is supposed on its first ray
};

class Method {
 public:
  virtual ~Method() = default;

  virtual void observe(const Sighting& sighting) = 0;
  // What is known from all sightings so far; nothing when the method has no answer. Valid until the next call.
  [[nodiscard]] virtual const FeatureEstimate* estimate() = 0;
  // Of the estimate.
  [[nodiscard]] virtual BasisLayout layout() const = 0;
  // The last sighting against its prediction, in units of z; NaN when there was none.
  [[nodiscard]] virtual double last_innovation() const = 0;
};

enum class MethodKind : std::uint8_t {
  kStaticEkf,   // extended Kalman filter of an unmoving point
  kFourierEkf,  // the same on the Fourier state
  kIterated,    // the paper's damped Gauss-Newton, started on the first ray
  kDelayed,     // ours: robust batch start, then Levenberg-Marquardt and the gate
  kBatch        // one batch MAP estimate of all sightings
};

[[nodiscard]] std::string method_name(MethodKind kind);

struct MethodOptions {
  int buffered = 60;          // sightings before the delayed start
  int paper_iterations = 20;  // of the paper's update
  double paper_step = 1.0;    // its gamma
  bool only_good = false;     // the batch is told which sightings are outliers, and leaves them out
};

[[nodiscard]] std::unique_ptr<Method> make_method(MethodKind kind, const MethodSetting& setting,
                                                  const MethodOptions& options = {});

// The observation of a feature supposed to be at p_WF: pose noise enters R there.
[[nodiscard]] Observation observation_of(const Scene& scene, const BasisLayout& layout, const Sighting& sighting,
                                         const Vector3d& p_WF);

// Distance of the feature from the camera in the frame of its first sighting, mm.
[[nodiscard]] double true_first_depth_mm(const Scene& scene, const SceneFeature& feature);

}  // namespace perimap
