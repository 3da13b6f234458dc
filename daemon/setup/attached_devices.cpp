#include "daemon/setup/attached_devices.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <system_error>

namespace perimap {
namespace {

// Entries of a folder that this one wants, by their names; none when there is no such folder.
template <class Wanted>
std::vector<std::string> entries(const std::filesystem::path& folder, const Wanted& wanted) {
  std::vector<std::string> found;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (wanted(name)) found.push_back(at->path().string());
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

AttachedPort port_of(const std::string& path) {
  AttachedPort port{path, "", ""};
  const std::string name = lower(path);
  const auto has = [&](std::string_view part) { return name.find(part) != std::string::npos; };
  if (has("ndi") || has("northern_digital")) port.tracker = "ndi";
  // OpenBCI's dongle.
  if (has("ft231x")) port.ecg = "cyton";
  if (has("bitalino")) port.ecg = "bitalino";
  if (has("medlab")) port.ecg = "medlab";
  return port;
}

}  // namespace

std::vector<std::string> attached_cameras(const std::filesystem::path& dev) {
  // Of a camera's nodes the first gives pictures.
  auto named = entries(dev / "v4l" / "by-id", [](const std::string& name) { return name.ends_with("-index0"); });
  if (!named.empty()) return named;
  return entries(dev, [](const std::string& name) { return name.starts_with("video") && name.size() > 5; });
}

std::vector<AttachedPort> attached_ports(const std::filesystem::path& dev) {
  auto named = entries(dev / "serial" / "by-id", [](const std::string&) { return true; });
  if (named.empty()) {
    named =
        entries(dev, [](const std::string& name) { return name.starts_with("ttyUSB") || name.starts_with("ttyACM"); });
  }
  std::vector<AttachedPort> ports;
  for (const std::string& path : named) ports.push_back(port_of(path));
  return ports;
}

}  // namespace perimap
