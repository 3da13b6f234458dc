#include "daemon/setup/device_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace perimap {

std::vector<DeviceChoice> camera_choices(const std::vector<std::string>& cameras) {
  std::vector<DeviceChoice> choices;
  for (const std::string& path : cameras) choices.push_back({"v4l2:" + path, path});
  return choices;
}

std::vector<DeviceChoice> port_choices(const std::vector<AttachedPort>& ports, std::string AttachedPort::*guess,
                                       const std::vector<std::string>& protocols) {
  std::vector<DeviceChoice> choices;
  const auto add = [&](const std::string& protocol, const std::string& path) {
    choices.push_back({protocol + "=" + path, fmt::format("{} at {}", protocol, path)});
  };
  for (const AttachedPort& port : ports) {
    if (!(port.*guess).empty()) add(port.*guess, port.path);
  }
  for (const AttachedPort& port : ports) {
    if (!(port.*guess).empty()) continue;
    for (const std::string& protocol : protocols) add(protocol, port.path);
  }
  return choices;
}

Expected<NamedPort> parse_named_port(const std::string& option, const std::string& text,
                                     const std::vector<std::string>& protocols) {
  if (text.empty() || text == "none") return NamedPort{};
  const std::size_t equals = text.find('=');
  const std::string protocol = text.substr(0, equals);
  if (equals == std::string::npos || equals + 1 == text.size() ||
      std::find(protocols.begin(), protocols.end(), protocol) == protocols.end()) {
    return fail(
        fmt::format("{}: expected PROTOCOL=PORT with a protocol of {}, such as {}=tcp:192.168.1.10:8765, got "
                    "'{}'",
                    option, fmt::join(protocols, ", "), protocols.front(), text));
  }
  return NamedPort{protocol, text.substr(equals + 1)};
}

}  // namespace perimap
