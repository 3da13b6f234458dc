// Which of the tools that the device knows is which of those that were asked for.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/tracker/ndi_session.hpp"

namespace perimap {
namespace {

std::string list_of(std::span<const std::uint16_t> handles) {
  std::string list;
  for (const std::uint16_t handle : handles) list += fmt::format("{}{:02X}", list.empty() ? "" : ", ", handle);
  return list;
}

}  // namespace

const NdiTool* NdiSession::tool_settings(std::size_t tool) const noexcept {
  if (tool == 0) return &settings_.sensor;
  if (tool == 1) return settings_.reference ? &*settings_.reference : nullptr;
  return &settings_.tools[tool - 2];
}

std::uint16_t& NdiSession::handle_of(std::size_t tool) noexcept {
  return tool == 0 ? sensor_handle_ : tool == 1 ? reference_handle_ : others_[tool - 2].handle;
}

std::optional<std::string> NdiSession::wanted_at(std::uint16_t handle) const {
  const auto asked = [](const NdiTool& tool) { return tool.handle || !tool.definition.empty(); };
  if (asked(settings_.sensor) && handle == sensor_handle_) return "the sensor";
  if (settings_.reference && handle == reference_handle_) return "the reference";
  for (std::size_t i = 0; i < others_.size(); ++i) {
    if (others_[i].handle == handle) return "the " + settings_.tools[i].name;
  }
  return std::nullopt;
}

void NdiSession::on_broken_port(LinkControl& link, const std::string& why, Instant now) {
  if (const auto wanted = wanted_at(port_)) {
    return link.fail(fmt::format("{}, port handle {:02X}, cannot be used: {} answered with {}", *wanted, port_,
                                 command_name(), why));
  }
  broken_.push_back({port_, why});
  std::erase(enabled_, port_);
  retries_ = 0;
  next_port(link, step_ == Step::kInitialisePort ? Step::kFindToInitialise : Step::kFindToEnable, now);
}

// What goes on without being as it was asked for, and what was left alone.
void NdiSession::tell_notice() {
  std::vector<std::string> notices;
  for (std::size_t i = 0; i < others_.size(); ++i) {
    if (std::find(enabled_.begin(), enabled_.end(), others_[i].handle) != enabled_.end()) continue;
    notices.push_back(fmt::format("the {} is not there: no port handle {:02X}; there are: {}", settings_.tools[i].name,
                                  others_[i].handle, list_of(enabled_)));
  }
  for (const NdiBrokenPort& port : broken_) {
    notices.push_back(fmt::format("port handle {:02X}, which nobody asked for, cannot be used and is left alone: {}",
                                  port.handle, port.why));
  }
  if (!jumps_.empty()) notices.push_back(jumps_);
  health_.set_notice(fmt::format("{}", fmt::join(notices, "; ")));
}

bool NdiSession::choose_tools(LinkControl& link) {
  const auto present = [this](std::uint16_t handle) {
    return std::find(enabled_.begin(), enabled_.end(), handle) != enabled_.end();
  };
  if (settings_.reference && !present(reference_handle_)) {
    link.fail(
        fmt::format("no such reference tool: port handle {:02X}; there are: {}", reference_handle_, list_of(enabled_)));
    return false;
  }
  if (settings_.sensor.definition.empty() && !settings_.sensor.handle && !choose_unnamed_sensor(link)) return false;
  if (!present(sensor_handle_)) {
    link.fail(fmt::format("no such tool: port handle {:02X}; there are: {}", sensor_handle_, list_of(enabled_)));
    return false;
  }
  if (settings_.reference && sensor_handle_ == reference_handle_) {
    link.fail(fmt::format("sensor and reference are both the tool of port handle {:02X}", sensor_handle_));
    return false;
  }
  health_.set_identity(
      fmt::format("{}{}tools at port handles {}", version_, version_.empty() ? "" : "; ", list_of(enabled_)));
  tell_notice();
  return true;
}

// The one tool that nobody else is, and no other one when the link was lost meanwhile.
bool NdiSession::choose_unnamed_sensor(LinkControl& link) {
  std::vector<std::uint16_t> others = enabled_;
  if (settings_.reference) std::erase(others, reference_handle_);
  for (const OtherTool& other : others_) std::erase(others, other.handle);
  const std::string beside = !others_.empty()      ? " beside those that were named"
                             : settings_.reference ? " beside the reference"
                                                   : "";
  if (others.empty()) {
    std::string broken;
    for (const NdiBrokenPort& port : broken_) broken += fmt::format("; port handle {:02X}: {}", port.handle, port.why);
    link.fail(fmt::format("the tracker knows no tool{}: name a tool definition or plug one in{}", beside, broken));
    return false;
  }
  // One that cannot be used may well be the sensor.
  if (others.size() + broken_.size() > 1) {
    std::string all = list_of(others);
    for (const NdiBrokenPort& port : broken_)
      all += fmt::format("; {:02X}, which cannot be used: {}", port.handle, port.why);
    link.fail(fmt::format("several tools{} ({}): say by tracker.sensor which one is the sensor", beside, all));
    return false;
  }
  if (unnamed_sensor_ && *unnamed_sensor_ != others.front()) {
    link.fail(
        fmt::format("port handle {:02X} is there, and {:02X} was the sensor: plug that in, or say by "
                    "tracker.sensor which one it is",
                    others.front(), *unnamed_sensor_));
    return false;
  }
  unnamed_sensor_ = sensor_handle_ = others.front();
  return true;
}

}  // namespace perimap
