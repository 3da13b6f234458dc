// The surface through the features of a replay, against the truth of its recording.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/pipeline/pipeline.hpp"
#include "core/surface/periodic_surface.hpp"
#include "daemon/evaluation/report/recorded_truth.hpp"
#include "daemon/evaluation/surface/seen_surface.hpp"
#include "daemon/evaluation/surface/surface_figures.hpp"

namespace perimap {

// In lockstep. Reads what the mapper hands to whoever keeps the map, two slots a frame, so that a feature is as old as
// a round of them takes; and once a second of captures makes a surface of it and scores that at the instant for which
// the frame's surface is valid, with the phase as it is known then. It asks for nothing that the pipeline would not do
// anyhow, so that what is published stays the same.
class SurfaceWatch {
 public:
  // Both must outlive it; it is the one reader of the pipeline's map feed.
  SurfaceWatch(Pipeline& pipeline, const RecordedTruth& truth);

  // After each frame that was mapped.
  void after_frame();

  [[nodiscard]] SurfaceFigures figures() const;

 private:
  struct Known {
    SurfaceEvidence evidence;
    Instant last_observed;
  };
  // The features at one instant, and the surface's places for the points that were seen.
  struct Scene;

  void take_feed();
  void fit(Instant capture);
  void score(Instant capture);
  void score_instant(const Scene& scene, std::size_t horizon, Instant valid);

  Pipeline& pipeline_;
  const GroundTruth& truth_;
  SeenSurface seen_;
  Instant first_frame_;
  std::map<std::size_t, Known> known_;  // by slot
  std::uint64_t maps_forgotten_ = 0;
  Vector3d camera_sum_W_ = Vector3d::Zero();
  std::size_t cameras_ = 0;
  std::optional<Instant> last_scored_;
  std::uint64_t fits_ = 0;
  std::vector<SurfaceEvidence> evidence_;  // that the surface was made of
  std::optional<PeriodicSurface> surface_;
  SurfaceKernels kernels_;
  std::string refusal_;
  SurfaceTally tally_;
};

}  // namespace perimap
