// The devices of a configuration into a recording, without a pipeline.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "core/calibration/turned_scope.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/time/instant.hpp"
#include "daemon/config/configuration.hpp"
#include "daemon/config/setup_error.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/session_recorder.hpp"

namespace perimap {

// The configuration that holds, with what a played recording brings along, and its camera.
struct RecordingBasis {
  Configuration configuration;
  std::optional<CameraModel> camera;  // none: no calibration is named
  std::optional<TurnedScope> turned_scope;
};

// Errors name the configuration, and its line and key where it is at fault.
[[nodiscard]] SetupExpected<RecordingBasis> recording_basis(const std::string& configuration_file);

// "12 s: 3456 messages recorded, 78 MB; not recorded: 0 frames, 0 others".
[[nodiscard]] std::string progress_line(const SessionRecorder& recorder, Duration elapsed);

// Until the signal, the end of what is played, the limit or an error of the disk. `feeder` records and has been
// started; `tell` is given a progress_line() every five seconds.
void record_until_ended(DeviceFeeder& feeder, StopSignal& stop, std::optional<Duration> limit,
                        const std::function<void(const std::string&)>& tell);

}  // namespace perimap
