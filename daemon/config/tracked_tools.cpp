#include "daemon/config/tracked_tools.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <utility>

namespace perimap {
namespace {

// One spelling for each port handle; names are what they are.
std::string spelling(const std::string& tool, TrackerConfiguration::Protocol protocol) {
  if (protocol != TrackerConfiguration::Protocol::kNdi) return tool;
  std::string capitals(tool.substr(std::min(tool.find_first_not_of('0'), tool.size())));
  std::transform(capitals.begin(), capitals.end(), capitals.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return capitals;
}

std::optional<std::size_t> tool_of(const std::vector<std::string>& names, const char* tool) {
  const auto found = std::find(names.begin(), names.end(), tool);
  if (found == names.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names.begin());
}

}  // namespace

bool same_tool(const std::string& a, const std::string& b, TrackerConfiguration::Protocol protocol) {
  return spelling(a, protocol) == spelling(b, protocol);
}

std::vector<std::string> tracked_tool_names(const TrackerConfiguration& c) {
  const bool uploads = c.protocol == TrackerConfiguration::Protocol::kNdi;
  std::vector<std::string> names;
  names.emplace_back(c.reference || (uploads && c.reference_definition) ? "reference" : "");
  if (c.pointer || (uploads && c.pointer_definition)) names.emplace_back("pointer");
  if (c.second_sensor || (uploads && c.second_sensor_definition)) names.emplace_back(kSecondSensorTool);
  if (c.patient_tool || (uploads && c.patient_tool_definition)) names.emplace_back(kPatientTool);
  for (const std::string& instrument : c.instruments) names.push_back("instrument/" + instrument);
  if (!uploads) return names;
  for (const auto& definition : c.instrument_definitions) names.push_back("instrument/" + definition.stem().string());
  return names;
}

std::optional<std::size_t> second_sensor_of(const std::vector<std::string>& names) {
  return tool_of(names, kSecondSensorTool);
}

std::array<std::optional<std::size_t>, kToolRoles> roles_of(const std::vector<std::string>& names) {
  return {tool_of(names, kSecondSensorTool), tool_of(names, kPatientTool)};
}

std::optional<ToolTwice> tool_named_twice(const TrackerConfiguration& c) {
  std::vector<std::pair<std::string, std::string>> named;  // key, tool
  const bool uploads = c.protocol == TrackerConfiguration::Protocol::kNdi;
  const auto add = [&named, uploads](const char* key, const std::optional<std::string>& tool, bool has_definition) {
    if (tool && !(uploads && has_definition)) named.emplace_back(key, *tool);  // what is uploaded is given a handle
  };
  add("tracker.sensor", c.sensor, c.sensor_definition.has_value());
  add("tracker.reference", c.reference, c.reference_definition.has_value());
  add("tracker.pointer", c.pointer, c.pointer_definition.has_value());
  add("tracker.second_sensor", c.second_sensor, c.second_sensor_definition.has_value());
  add("tracker.patient_tool", c.patient_tool, c.patient_tool_definition.has_value());
  for (const std::string& instrument : c.instruments) named.emplace_back("tracker.instruments", instrument);
  std::map<std::string, std::string> seen;  // spelling, key
  for (const auto& [key, tool] : named) {
    const auto [before, is_new] = seen.emplace(spelling(tool, c.protocol), key);
    if (!is_new) return ToolTwice{key, tool, before->second};
  }
  std::vector<std::string> names = tracked_tool_names(c);
  std::sort(names.begin(), names.end());
  const auto same = std::adjacent_find(names.begin(), names.end());
  if (same == names.end() || same->empty()) return std::nullopt;
  return ToolTwice{"tracker.instrument_definitions", *same, "tracker.instruments"};
}

}  // namespace perimap
