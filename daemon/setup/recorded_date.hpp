// When what is measured from a recording was measured.
#pragma once

#include <string>

namespace perimap {

// When the recording begins, by its own stamps and what it says of their clock: 2026-11-25 18:30 UTC. Of one that says
// nothing of that, as other programs write them, today's, and that it is not the recording's. Without a recording, now.
[[nodiscard]] std::string date_of_measurement(const std::string& recording);

}  // namespace perimap
