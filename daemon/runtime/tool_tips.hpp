// Which tracked tools have a tip, and where it is.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/tool/tool_distance.hpp"
#include "daemon/config/configuration.hpp"
#include "daemon/config/wrong_key.hpp"

namespace perimap {

// What is wrong with the calibrations of instruments: one that cannot be read, that does not say of which tool it is,
// that is of none of the tracker's instruments, or of the same as another.
[[nodiscard]] WrongKeys wrong_tips(const TrackerConfiguration& tracker);

// Those of `names` (by ToolSample::tool, as tracked_tool_names() has them) whose distance is told: the pointer and the
// instruments. A tip is the configuration's, else what `of_recording` has of the name, if it has any. One without is
// told of too: that it is not calibrated. The configuration has passed wrong_calibrations().
[[nodiscard]] std::vector<WatchedTool> watched_tools(
    const std::vector<std::string>& names, const TrackerConfiguration& tracker,
    const std::function<std::optional<TipInTool>(const std::string& name)>& of_recording = {});

}  // namespace perimap
