// The surface through the features of a replay, against the truth of its recording.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/surface_maker.hpp"
#include "daemon/evaluation/report/recorded_truth.hpp"
#include "daemon/evaluation/surface/model_score.hpp"
#include "daemon/evaluation/surface/seen_surface.hpp"
#include "daemon/evaluation/surface/surface_figures.hpp"

namespace perimap {

// In lockstep. Once a second of captures it scores the surface that the pipeline has adopted last, the one whose mesh
// is published, at the instant for which the frame's surface is valid, with the phase as it is known then. It asks for
// nothing that the pipeline would not do anyhow, so that what is published stays the same.
class SurfaceWatch {
 public:
  // Both must outlive it.
  SurfaceWatch(Pipeline& pipeline, const RecordedTruth& truth);

  // After each frame that was mapped.
  void after_frame();

  [[nodiscard]] SurfaceFigures figures() const;

 private:
  // The features at one instant, and the surface's places for the points that were seen.
  struct Scene;

  [[nodiscard]] const PeriodicSurface* surface() const noexcept;
  void score(Instant capture);
  void score_instant(const Scene& scene, std::size_t horizon, Instant valid);

  Pipeline& pipeline_;
  const GroundTruth& truth_;
  SeenSurface seen_;
  Instant first_frame_;
  std::optional<Instant> last_scored_;
  std::shared_ptr<const MadeSurface> made_;
  std::string refusal_;
  SurfaceTally tally_;
  ModelScore model_;
};

}  // namespace perimap
