// What a replay came to.
#pragma once

#include <perimap.h>

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/pipeline/release_stream.hpp"
#include "core/realtime/latency_histogram.hpp"
#include "daemon/evaluation/procedure/procedure_score.hpp"
#include "daemon/evaluation/report/accuracy.hpp"
#include "daemon/evaluation/surface/surface_figures.hpp"
#include "daemon/evaluation/tool/tool_figures.hpp"

namespace perimap {

struct ReplayReport {
  struct Stream {
    ReleaseStream stream{};
    std::uint64_t samples = 0, without_frame = 0, from_late_update = 0, missed = 0, late = 0;
    nlohmann::json counts;                    // of the status, what belongs to this stream
    std::optional<AccuracyReport> accuracy;   // where there is a truth
    std::optional<ProcedureScore> procedure;  // where it has a procedure
  };
  struct Stage {
    std::string name;
    LatencyHistogram::Summary times;
  };

  bool lockstep = false;
  bool stopped = false;  // by a signal, before the recording's end
  bool has_truth = false;
  int workers = 0;
  std::vector<Error> damage;  // what of the recording could not be used (ReadMode::kWhole)
  std::uint64_t frames = 0, frames_without_pose = 0, features_converged = 0;
  std::vector<Stream> streams;  // at least one
  std::vector<Stage> stages;
  std::optional<SurfaceFigures> surface;     // in lockstep, where there is a truth
  std::map<std::string, ToolFigures> tools;  // by name: in lockstep, of those that have a truth
  RespiratoryClock breathing;
  perimap_SetupWatch setup{};
  nlohmann::json counts;  // of the first stream's status, and of the sources
};

[[nodiscard]] std::string to_text(const ReplayReport& report);
// Without the recording's name.
[[nodiscard]] nlohmann::json to_json(const ReplayReport& report);

}  // namespace perimap
