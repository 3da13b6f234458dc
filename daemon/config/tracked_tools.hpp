// The tools that a configuration names beside the tracked sensor.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/sensors/tracker_sample.hpp"
#include "daemon/config/configuration.hpp"

namespace perimap {

// The tool that tells how an angled scope is turned, by its name of those below.
inline constexpr const char* kSecondSensorTool = "second_sensor";
// That which is moved as the organ is moved, likewise.
inline constexpr const char* kPatientTool = "patient_tool";

// By ToolSample::tool: "reference" (empty where there is none), "pointer", "second_sensor" and "patient_tool" where
// there is one, then "instrument/NAME". The names are those of messages, and of a recording's channels below
// channels::kTrackedTools. An instrument of a definition has the file's name without its extension.
[[nodiscard]] std::vector<std::string> tracked_tool_names(const TrackerConfiguration& configuration);
// Which of these is the second sensor.
[[nodiscard]] std::optional<std::size_t> second_sensor_of(const std::vector<std::string>& names);
// Which of them have a role in the pipeline, by ToolRole.
[[nodiscard]] std::array<std::optional<std::size_t>, kToolRoles> roles_of(const std::vector<std::string>& names);

// Whether the two name one tool. Of an NDI tracker handles are numbers, so that "a" is "0A".
[[nodiscard]] bool same_tool(const std::string& a, const std::string& b, TrackerConfiguration::Protocol protocol);

struct ToolTwice {
  std::string key;   // "tracker.pointer"
  std::string tool;  // as it is written there
  std::string also;  // the key that has it too
};

// A tool that two keys name: it cannot be both.
[[nodiscard]] std::optional<ToolTwice> tool_named_twice(const TrackerConfiguration& configuration);

}  // namespace perimap
