#include "daemon/probe/probe_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string_view>

namespace perimap {
namespace {

double milliseconds(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

// What the tool, the lead or the picture says, when it is not well.
std::string complaint(std::string_view kind, const ProbedSamples& seen) {
  if (seen.invalid == 0) return "";
  if (kind == "camera") return fmt::format("{} of {} frames cannot be decoded", seen.invalid, seen.count);
  if (kind == "ecg") return fmt::format("lead off in {} of {} samples", seen.invalid, seen.count);
  if (kind == "r_trigger") return "";
  return fmt::format("tool missing in {}, out of volume in {}, disabled in {} of {} readings", seen.tools[1],
                     seen.tools[2], seen.tools[3], seen.count);
}

// What went wrong last, or what the state alone tells.
std::string reason(std::string_view kind, const DeviceHealth& health) {
  std::string told = health.reason();
  if (!told.empty()) return told;
  switch (health.state()) {
    case DeviceState::kSilent:
      return "samples came and have stopped: switched off, cable out, or a device of another kind?";
    case DeviceState::kStarting:
      if (const std::string awaited = health.awaited(); !awaited.empty()) {
        return fmt::format("open: {} Listen for longer (--seconds)", awaited);
      }
      if (kind == "r_trigger") {
        return "open, but the line has not changed: is the monitor's output on, and wired to ecg.r_trigger_line?";
      }
      return "open, but nothing has come yet: listen for longer (--seconds)";
    default:
      return "";
  }
}

nlohmann::json as_json(std::string_view kind, const DeviceHealth& health, const ProbedSamples& seen,
                       const std::string& where) {
  const auto jitter = health.jitter.summary();
  return {{"where", where},
          {"state", device_state_name(health.state())},
          {"reason", health.state() == DeviceState::kStreaming ? "" : reason(kind, health)},
          {"identity", health.identity().empty() ? nlohmann::json(nullptr) : nlohmann::json(health.identity())},
          {"notice", health.notice()},
          {"openings", health.openings.get()},
          {"samples", health.samples.get()},
          {"rate_hz", seen.rate_hz()},
          {"invalid", seen.invalid},
          {"lost", health.lost.get()},
          {"damaged", health.damaged.get()},
          {"dropped", health.dropped.get()},
          {"bus_errors", health.bus_errors.get()},
          {"jitter_p50_ms", milliseconds(jitter.p50)},
          {"jitter_p99_ms", milliseconds(jitter.p99)},
          {"delay_p50_ms", milliseconds(seen.delay.summary().p50)},
          {"misnumbered", health.misnumbered.get()},
          {"largest_error_mm", seen.largest_error_mm}};
}

nlohmann::json as_json(const ProbedTool& tool) {
  const ProbedSamples& seen = tool.seen;
  return {{"readings", seen.count},
          {"rate_hz", seen.rate_hz()},
          {"ok", seen.tools[0]},
          {"missing", seen.tools[1]},
          {"out_of_volume", seen.tools[2]},
          {"disabled", seen.tools[3]},
          {"largest_error_mm", seen.largest_error_mm}};
}

std::string tool_text(const ProbedTool& tool) {
  const ProbedSamples& seen = tool.seen;
  if (seen.count == 0) return fmt::format("  {}: no reading\n", tool.name);
  return fmt::format("  {}: {} readings, seen in {}, missing in {}, out of volume in {}, disabled in {}\n", tool.name,
                     seen.count, seen.tools[0], seen.tools[1], seen.tools[2], seen.tools[3]);
}

nlohmann::json as_json(const ProbedBreathing& seen, int channel) {
  const bool any = seen.highest >= seen.lowest;
  return {{"channel", channel},
          {"samples", seen.samples.count},
          {"rate_hz", seen.samples.rate_hz()},
          {"sensor_off", seen.samples.invalid},
          {"lowest", any ? nlohmann::json(seen.lowest) : nlohmann::json(nullptr)},
          {"highest", any ? nlohmann::json(seen.highest) : nlohmann::json(nullptr)},
          {"breaths", seen.detector.signal().onsets},
          {"breath_s", to_seconds(seen.detector.signal().period)}};
}

std::string breathing_text(const nlohmann::json& j) {
  std::string told;
  const auto samples = j["samples"].get<std::uint64_t>();
  told += fmt::format("  breathing  input {}: {} samples", j["channel"].get<int>(), samples);
  const auto off = j["sensor_off"].get<std::uint64_t>();
  if (off > 0) told += fmt::format(", the sensor off in {}", off);
  if (samples > off)
    told += fmt::format(", from {:.4g} to {:.4g}", j["lowest"].get<float>(), j["highest"].get<float>());
  const auto breath_s = j["breath_s"].get<double>();
  if (breath_s > 0.0) told += fmt::format(", {:.2f} s a breath", breath_s);
  return told + "\n";
}

std::string device_text(const char* kind, const nlohmann::json& j, const std::string& invalid) {
  std::string told;
  const auto text = [&j](const char* key) { return j[key].get<std::string>(); };
  told += fmt::format("{} at {}: {}\n", kind, text("where"), text("state"));
  // What streams has told what it can: a Medlab, a CAN module and a trigger line have no words for it.
  if (!j["identity"].is_null()) {
    told += fmt::format("  identity   {}\n", text("identity"));
  } else if (text("state") == "streaming") {
    told += fmt::format("  identity   not told by this protocol\n");
  }
  if (j["samples"].get<std::uint64_t>() > 0) {
    told += fmt::format("  rate       {:.2f} Hz, {} samples\n", j["rate_hz"].get<double>(),
                        j["samples"].get<std::uint64_t>());
    told += fmt::format("  stamps     {:.2f} ms before arrival; jitter p50 {:.2f}, p99 {:.2f} ms\n",
                        j["delay_p50_ms"].get<double>(), j["jitter_p50_ms"].get<double>(),
                        j["jitter_p99_ms"].get<double>());
  }
  told += fmt::format("  faults     {} lost, {} damaged, {} dropped by the kernel, {} bus errors\n",
                      j["lost"].get<std::uint64_t>(), j["damaged"].get<std::uint64_t>(),
                      j["dropped"].get<std::uint64_t>(), j["bus_errors"].get<std::uint64_t>());
  if (!text("notice").empty()) told += fmt::format("  note       {}\n", text("notice"));
  if (!invalid.empty()) told += fmt::format("  validity   {}\n", invalid);
  if (!text("reason").empty() && text("state") != "streaming") told += fmt::format("  why        {}\n", text("reason"));
  return told;
}

}  // namespace

bool all_well(const ProbedDevices& devices) {
  return std::all_of(devices.begin(), devices.end(),
                     [](const auto& device) { return device->state == DeviceState::kStreaming; });
}

nlohmann::json to_json(const ProbedDevices& devices) {
  nlohmann::json json;
  for (const auto& device : devices) {
    json[device->kind] = as_json(device->kind, device->health, device->seen, device->where);
    for (const ProbedTool& tool : device->tools) {
      if (!tool.name.empty()) json[device->kind]["tools"][tool.name] = as_json(tool);
    }
    if (device->respiration_channel == 0) continue;
    json[device->kind]["respiration"] = as_json(device->breathing, device->respiration_channel);
  }
  return json;
}

std::string to_text(const ProbedDevices& devices) {
  std::string text;
  const nlohmann::json json = to_json(devices);
  for (const auto& device : devices) {
    const nlohmann::json& told = json[device->kind];
    text += device_text(device->kind, told, complaint(device->kind, device->seen));
    for (const ProbedTool& tool : device->tools) {
      if (!tool.name.empty()) text += tool_text(tool);
    }
    if (told.contains("respiration")) text += breathing_text(told["respiration"]);
  }
  return text;
}

}  // namespace perimap
