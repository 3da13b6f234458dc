// What a probe found, as text and as JSON, and what may be wrong.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/probe/device_probe.hpp"

namespace perimap {

// Whether all of them stream.
[[nodiscard]] bool all_well(const ProbedDevices& devices);

// By kind of device.
[[nodiscard]] nlohmann::json to_json(const ProbedDevices& devices);
[[nodiscard]] std::string to_text(const ProbedDevices& devices);

}  // namespace perimap
