// Which of the attached devices are offered, and how one is named.
#pragma once

#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/setup/attached_devices.hpp"

namespace perimap {

struct DeviceChoice {
  std::string value;  // "v4l2:/dev/video0", "ndi=/dev/ttyUSB0"
  std::string what;   // as it is shown
};

inline const std::vector<std::string> kTrackerProtocols{"ndi", "igtl"};
inline const std::vector<std::string> kEcgProtocols{"cyton", "bitalino", "medlab", "can"};

[[nodiscard]] std::vector<DeviceChoice> camera_choices(const std::vector<std::string>& cameras);

// Those whose name suggests the kind (`guess`: AttachedPort::tracker or ecg) first, then all others as each of the
// protocols.
[[nodiscard]] std::vector<DeviceChoice> port_choices(const std::vector<AttachedPort>& ports,
                                                     std::string AttachedPort::*guess,
                                                     const std::vector<std::string>& protocols);

// Empty: there is no such device.
struct NamedPort {
  std::string protocol;
  std::string port;
};

// "PROTOCOL=PORT", "none" or nothing. Errors begin with the option's name.
[[nodiscard]] Expected<NamedPort> parse_named_port(const std::string& option, const std::string& text,
                                                   const std::vector<std::string>& protocols);

}  // namespace perimap
