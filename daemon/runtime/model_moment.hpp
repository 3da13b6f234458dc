// What a surface model is made of, as it stands.
#pragma once

#include "core/pipeline/pipeline.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/pipeline/surface_state.hpp"
#include "daemon/publishing/model_moment.hpp"

namespace perimap {

// Status thread. It says how far ahead one sample of the surface reaches; to that comes the time to the next model.
[[nodiscard]] inline ModelMoment model_moment(Pipeline& pipeline, const CardiacClock& clock,
                                              const RespiratoryClock& respiration, Instant now) {
  const PipelineSettings& settings = pipeline.settings();
  ModelMoment moment;
  moment.snapshots = pipeline.model_snapshots();
  moment.layout = settings.estimator.layout;
  moment.clock = clock;
  moment.respiration = respiration;
  moment.footing = pipeline.model_footing(respiration, now);
  moment.now = now;
  moment.validity = settings.lead + settings.validity;
  return moment;
}

}  // namespace perimap
