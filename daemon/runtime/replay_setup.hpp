// From a configuration and a recording to a pipeline that can replay it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "daemon/config/configuration.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/publishing/identity.hpp"
#include "daemon/runtime/live_runtime.hpp"
#include "drivers/recording/replay_reader.hpp"

namespace perimap {

struct ReplaySetup {
  Configuration configuration;  // effective: defaults, then the recording's own, then the file's
  PipelineSettings pipeline;
  Identity identity;
  Duration utc_minus_monotonic{0};      // of the recording
  std::vector<Error> passed_over;       // keys of its configuration that do not describe the session (ReadMode::kWhole)
  ReplayReader reader;                  // at the first event
  std::vector<WatchedTool> tools = {};  // whose distance from the surface is told
};

// What a recording and a configuration file over it come to.
struct RecordedBasis {
  // Effective: defaults, then the recording's own, then the file's. Which tools a tracker has is the file's to say
  // alone.
  Configuration configuration;
  std::optional<std::string> sensor;         // whose poses the recording has, where it says so
  std::optional<std::string> second_sensor;  // and whose tell how the scope is turned
  CameraModel camera;                        // of the file's calibration, or the recording's own
  std::optional<TurnedScope> turned_scope;   // likewise
  Duration utc_minus_monotonic{0};
  std::vector<Error> passed_over;  // keys of its configuration that do not describe the session (ReadMode::kWhole)
};
[[nodiscard]] tl::expected<RecordedBasis, SetupError> recorded_basis(
    const std::string& recording, const std::optional<std::filesystem::path>& configuration_file, ReadMode mode);

// `configuration_file`: none for the recording's own configuration over the defaults.
[[nodiscard]] tl::expected<ReplaySetup, SetupError> prepare_replay(
    const std::string& recording, const std::optional<std::filesystem::path>& configuration_file, ReadMode mode);

[[nodiscard]] PipelineSettings pipeline_settings(const Configuration& configuration, const CameraModel& camera);
[[nodiscard]] RuntimeSettings runtime_settings(const Configuration& configuration, const Identity& identity);

}  // namespace perimap
