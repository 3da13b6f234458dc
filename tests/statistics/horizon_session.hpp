// The whole pipeline in lockstep over a simulated session, and how far what it displays is off at several horizons.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/surface_composer.hpp"
#include "daemon/evaluation/report/accuracy.hpp"
#include "daemon/publishing/publication.hpp"
#include "daemon/publishing/wire_surface.hpp"
#include "daemon/runtime/lockstep_runtime.hpp"
#include "drivers/standins/simulator/simulation.hpp"

namespace perimap::test {

// At one horizon.
struct HorizonErrors {
  static constexpr double kSpan_s = 10.0;
  struct Span {
    double positions = 0.0;
    double square_sum_mm2 = 0.0;
    [[nodiscard]] double rms_mm() const;
  };
  double rms_mm = 0.0;
  double nees = 0.0;        // NEES/3
  std::vector<Span> spans;  // of kSpan_s each
  GoodPositions good;       // of surfaces and features that are called so

  // RMS of all spans from this one on, mm.
  [[nodiscard]] double rms_from(std::size_t span) const;
  // RMS of each, mm; not a number where there is nothing.
  [[nodiscard]] std::vector<double> rms_by_span() const;
};

// Composes every release anew for each horizon, with all that is known at the release, and compares with the truth.
class HorizonSession final : public Publication {
 public:
  HorizonSession(const Simulation& simulation, const PipelineSettings& settings, const std::vector<Duration>& horizons);

  void surface(const perimap_Surface& sample) override;
  void surface_model(const perimap_SurfaceModel& model) override;
  void phase(const perimap_Phase& phase) override { static_cast<void>(phase); }
  void status(const perimap_Status& status) override { static_cast<void>(status); }

  [[nodiscard]] LockstepRuntime& runtime() { return *runtime_; }
  // In the order of the horizons.
  [[nodiscard]] std::vector<HorizonErrors> errors() const;
  // Features and law in words.
  [[nodiscard]] std::string description() const;

 private:
  struct Ahead {
    Ahead(const ComposerSettings& settings, const GroundTruth& truth, const CameraModel& camera, Instant start)
        : composer(settings), wire(Identity{}, settings.maximum_features), accuracy(truth, camera, start) {}
    SurfaceComposer composer;
    WireSurface wire;
    Accuracy accuracy;
  };

  Instant start_;
  PhaseLaw law_;
  std::optional<double> law_changed_s_;  // the last time, from the first frame on
  std::unique_ptr<Pipeline> pipeline_;
  std::vector<std::unique_ptr<Ahead>> ahead_;
  std::unique_ptr<LockstepRuntime> runtime_;
};

}  // namespace perimap::test
