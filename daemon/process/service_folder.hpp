// Where a service keeps its files.
#pragma once

#include <optional>
#include <string>

namespace perimap {

// `name` in the folder that systemd gives by $RUNTIME_DIRECTORY or $STATE_DIRECTORY (systemd.exec(5)); none when the
// process is no service, or has several such folders.
[[nodiscard]] std::optional<std::string> service_file(const char* variable, const std::string& name);

}  // namespace perimap
