#include "daemon/runtime/tool_tips.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>
#include <utility>

#include "daemon/config/tracked_tools.hpp"
#include "drivers/calibration/calibration_facts.hpp"
#include "drivers/calibration/tool_tip.hpp"

namespace perimap {
namespace {

constexpr const char* kKey = "tracker.instrument_calibrations";
constexpr std::string_view kInstrument = "instrument/";

// Of which tool a calibration is, as `perimap calibrate tool` writes it: a recording's by its role.
std::optional<std::string> tool_of(const std::filesystem::path& file) {
  auto tool = calibration_fact(file, "tool");
  if (tool && tool->starts_with(kInstrument)) tool->erase(0, kInstrument.size());
  return tool;
}

bool is_of(const std::filesystem::path& file, const std::string& instrument, const TrackerConfiguration& tracker) {
  const auto tool = tool_of(file);
  return tool && same_tool(*tool, instrument, tracker.protocol);
}

// "instrument/NAME" of those that the configuration names.
std::vector<std::string> instruments_of(const TrackerConfiguration& tracker) {
  std::vector<std::string> instruments;
  for (const std::string& name : tracked_tool_names(tracker)) {
    if (name.starts_with(kInstrument)) instruments.push_back(name.substr(kInstrument.size()));
  }
  return instruments;
}

std::optional<TipInTool> tip_of(const std::filesystem::path& file) {
  const auto tip = read_tool_tip(file);
  if (!tip) return std::nullopt;
  return TipInTool{tip->tip_T, tip->covariance_T};
}

}  // namespace

WrongKeys wrong_tips(const TrackerConfiguration& tracker) {
  WrongKeys all;
  const std::vector<std::string> instruments = instruments_of(tracker);
  std::set<std::string> seen;
  for (const std::filesystem::path& file : tracker.instrument_calibrations) {
    const auto tip = read_tool_tip(file);
    const auto tool = tool_of(file);
    if (!tip) {
      all.push_back({kKey, tip.error().message});
    } else if (!tool) {
      all.push_back({kKey, fmt::format("{}: key 'tool' does not say of which tool it is", file.string())});
    } else if (tracker.protocol != TrackerConfiguration::Protocol::kNone &&
               std::none_of(instruments.begin(), instruments.end(),
                            [&](const std::string& i) { return same_tool(i, *tool, tracker.protocol); })) {
      all.push_back({kKey, fmt::format("{}: expected one of a tool in 'tracker.instruments', got one of \"{}\"",
                                       file.string(), *tool)});
    } else if (!seen.insert(*tool).second) {
      all.push_back(
          {kKey, fmt::format("{}: expected one for each tool, got a second one of \"{}\"", file.string(), *tool)});
    }
  }
  return all;
}

std::vector<WatchedTool> watched_tools(
    const std::vector<std::string>& names, const TrackerConfiguration& tracker,
    const std::function<std::optional<TipInTool>(const std::string& name)>& of_recording) {
  std::vector<WatchedTool> watched;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const bool instrument = names[i].starts_with(kInstrument);
    if (!instrument && names[i] != "pointer") continue;
    WatchedTool tool{names[i], i, std::nullopt};
    if (!instrument && tracker.pointer_calibration) tool.tip = tip_of(*tracker.pointer_calibration);
    for (const std::filesystem::path& file : tracker.instrument_calibrations) {
      if (instrument && is_of(file, names[i].substr(kInstrument.size()), tracker)) tool.tip = tip_of(file);
    }
    if (!tool.tip && of_recording) tool.tip = of_recording(names[i]);
    watched.push_back(std::move(tool));
  }
  return watched;
}

}  // namespace perimap
