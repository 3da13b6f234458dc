// What is plugged into this machine that may be a camera, a tracker or an ECG device.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace perimap {

struct AttachedPort {
  std::string path;
  std::string tracker;  // the protocol that its name suggests; empty: none
  std::string ecg;      // likewise
};

// By their lasting names where there are such, in order. `dev`: the folder of devices, other than /dev in tests.
[[nodiscard]] std::vector<std::string> attached_cameras(const std::filesystem::path& dev = "/dev");
[[nodiscard]] std::vector<AttachedPort> attached_ports(const std::filesystem::path& dev = "/dev");

}  // namespace perimap
