// What of a configuration describes a session, and not the machine or the run.
#pragma once

#include "daemon/config/configuration_keys.hpp"

namespace perimap {

// Whether a recording may bring the key along: noise and place of what was seen and heard (camera, tracker, hand-eye, R
// trigger), whether it may come again (of what was played in a loop), whose poses they are (sensor, pointer), rhythm,
// breathing and estimator. Not those that name files and devices, or that a device's driver has applied to its samples
// before they were recorded.
[[nodiscard]] bool describes_session(const ConfigurationKey& key);

}  // namespace perimap
