// The whole pipeline over a recording, and what it came to.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "daemon/evaluation/replay/replay_report.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/runtime/replay_setup.hpp"

namespace perimap {

class UnrecordedSession;

struct ReplayOptions {
  std::string recording;
  // In lockstep: whose recording() that is; its pictures are rendered meanwhile. Outlives the run.
  const UnrecordedSession* simulated = nullptr;
  std::optional<std::filesystem::path> configuration;  // none: the recording's own over the defaults
  bool lockstep = false;                               // virtual time, or else real time
  int workers = 0;                                     // 0: the configuration's
  std::string samples;                                 // a recording of what is published; empty: none
  std::string program = "perimap replay";              // before each line of the log
  std::string generator;                               // what it says to have written it
  bool dds = false;                                    // publish, too
  ReadMode mode = ReadMode::kStrict;
};

// `progress` hears now and then of the frames that are done, and of how many there are where the recording says (0: it
// does not). A signal ends it early; what was published until then is reported and recorded.
[[nodiscard]] tl::expected<ReplayReport, SetupError> run_replay(
    const ReplayOptions& options, StopSignal& stop,
    const std::function<void(std::uint64_t frames, std::uint64_t all)>& progress);

}  // namespace perimap
