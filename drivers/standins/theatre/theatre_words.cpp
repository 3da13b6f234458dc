#include "drivers/standins/theatre/theatre_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace perimap {
namespace {

Expected<void> check_can_frame(const CanEcgSettings& can, const std::vector<EmulatedDevice>& devices, bool can_given) {
  const auto is_can = [](const EmulatedDevice& device) { return device.name == "can-ecg"; };
  if (can_given && std::none_of(devices.begin(), devices.end(), is_can)) {
    return fail("--can-...: expected the device 'can-ecg'");
  }
  constexpr std::uint32_t kLargest = CanEcgSettings::kLargestStandardIdentifier;
  if (!can.extended && can.identifier > kLargest) {
    return fail(fmt::format("--can-identifier: expected at most 0x{:X} without --can-extended, got 0x{:X}", kLargest,
                            can.identifier));
  }
  return {};
}

}  // namespace

Expected<TheatreSettings> with_words(TheatreSettings settings, const TheatreWords& words) {
  const auto spans = [](const std::vector<double>& given, Duration& every, Duration& lasting) {
    if (given.size() != 2) return;
    every = from_seconds(given[0]);
    lasting = from_seconds(given[1]);
  };
  spans(words.missing_s, settings.faults.missing_every, settings.faults.missing_for);
  spans(words.unplug_s, settings.faults.unplug_every, settings.faults.unplug_for);
  if (!words.ndi_reference.empty()) {
    const auto reference = parse_place(words.ndi_reference, "--ndi-reference");
    if (!reference) return tl::unexpected(reference.error());
    settings.ndi.reference = *reference;
    // Where tools are wired the reference is, too.
    if (settings.ndi.wired_tools == 1) settings.ndi.wired_tools = 2;
  }
  for (const std::string& text : words.tools) {
    auto tool = parse_emulated_tool(text);
    if (!tool) return tl::unexpected(tool.error());
    settings.tools.push_back(std::move(*tool));
  }
  for (const std::string& text : words.broken) {
    const auto handle = port_handle_of(text);
    if (!handle) return tl::unexpected(handle.error());
    settings.ndi.broken.insert(*handle);
  }
  if (words.frame_jump.size() == 2) {
    settings.ndi.jump_every = from_seconds(std::max(words.frame_jump[0], 0.01));
    settings.ndi.jump_by = std::llround(words.frame_jump[1]);
  }
  return settings;
}

Expected<std::vector<EmulatedDevice>> parse_emulated_devices(const std::vector<std::string>& texts,
                                                             const TheatreSettings& settings, bool can_given) {
  std::vector<EmulatedDevice> devices;
  for (const std::string& text : texts) {
    auto device = parse_emulated_device(text);
    if (!device) return tl::unexpected(device.error());
    if (auto able = check_faults(*device, settings.faults); !able) return tl::unexpected(able.error());
    devices.push_back(std::move(*device));
  }
  if (auto frame = check_can_frame(settings.can, devices, can_given); !frame) return tl::unexpected(frame.error());
  return devices;
}

}  // namespace perimap
