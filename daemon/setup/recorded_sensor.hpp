// Which tracked tools a recording is of, by the tracker's own names for them.
#pragma once

#include <optional>
#include <string>

#include "core/error/expected.hpp"
#include "daemon/config/configuration.hpp"

namespace perimap {

// The port handle or name of a tool of a recording (kScopeTool: the scope's sensor), as the configuration that it was
// recorded with says; none: it does not say.
[[nodiscard]] Expected<std::optional<std::string>> recorded_handle(const std::string& recording,
                                                                   const std::string& tool);

// Of which sensor a calibration from the recording is: as the recording says or, where it does not, the configuration.
// `file` is the configuration's, and stands in messages. Fails where they say otherwise.
[[nodiscard]] Expected<std::optional<std::string>> calibrated_sensor(const std::string& recording,
                                                                     const Configuration& configuration,
                                                                     const std::string& file);

}  // namespace perimap
