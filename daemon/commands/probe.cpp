#include "daemon/commands/probe.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "core/phase/breath_detector.hpp"
#include "core/pipeline/hear_breath.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "drivers/image/grey_converter.hpp"

namespace perimap {
namespace {

struct Options {
  std::string file;
  double seconds = 5.0;
  bool json = false;
};

// What a device's samples came to. Written by its thread, read after it has ended.
struct Seen {
  std::uint64_t invalid = 0;
  std::array<std::uint64_t, 4> tools{};  // by ToolState
  LatencyHistogram delay;
  std::uint64_t count = 0;
  std::uint64_t first_count = 0;  // of them with the first stamp
  Instant first{}, last{};

  // `t`: of the last of these samples.
  void add(Instant t, std::uint64_t samples) {
    if (count == 0) {
      first = t;
      first_count = samples;
    }
    last = t;
    count += samples;
  }
  // Of the samples' own stamps; 0 until there are some.
  [[nodiscard]] double rate_hz() const {
    const double span_s = to_seconds(last - first);
    return span_s > 0.0 ? static_cast<double>(count - first_count) / span_s : 0.0;
  }
};

// What a respiration channel says while it is listened to.
struct SeenBreathing {
  Seen samples;
  float lowest = std::numeric_limits<float>::infinity();
  float highest = -std::numeric_limits<float>::infinity();
  BreathDetector detector;

  void add(const RespirationBlock& block) {
    samples.add(block.last_sample_time(), block.count);
    samples.delay.add(block.arrival - block.last_sample_time());
    hear_breath(block, detector);
    if (block.sensor_off) {
      samples.invalid += block.count;
      return;
    }
    for (const float value : block.samples()) {
      lowest = std::min(lowest, value);
      highest = std::max(highest, value);
    }
  }
};

double milliseconds(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

// What the tool, the lead or the picture says, when it is not well.
std::string complaint(std::string_view kind, const Seen& seen) {
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

nlohmann::json as_json(std::string_view kind, const DeviceHealth& health, const Seen& seen, const std::string& where) {
  const auto jitter = health.jitter.summary();
  return {{"where", where},
          {"state", device_state_name(health.state())},
          {"reason", health.state() == DeviceState::kStreaming ? "" : reason(kind, health)},
          {"identity", health.identity().empty() ? nlohmann::json(nullptr) : nlohmann::json(health.identity())},
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
          {"delay_p50_ms", milliseconds(seen.delay.summary().p50)}};
}

nlohmann::json as_json(const SeenBreathing& seen, int channel) {
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

void print_breathing(const nlohmann::json& j) {
  const auto samples = j["samples"].get<std::uint64_t>();
  fmt::print("  breathing  input {}: {} samples", j["channel"].get<int>(), samples);
  const auto off = j["sensor_off"].get<std::uint64_t>();
  if (off > 0) fmt::print(", the sensor off in {}", off);
  if (samples > off) fmt::print(", from {:.4g} to {:.4g}", j["lowest"].get<float>(), j["highest"].get<float>());
  const auto breath_s = j["breath_s"].get<double>();
  if (breath_s > 0.0) fmt::print(", {:.2f} s a breath", breath_s);
  fmt::print("\n");
}

void print(const char* kind, const nlohmann::json& j, const std::string& invalid) {
  const auto text = [&j](const char* key) { return j[key].get<std::string>(); };
  fmt::print("{} at {}: {}\n", kind, text("where"), text("state"));
  // What streams has told what it can: a Medlab, a CAN module and a trigger line have no words for it.
  if (!j["identity"].is_null()) {
    fmt::print("  identity   {}\n", text("identity"));
  } else if (text("state") == "streaming") {
    fmt::print("  identity   not told by this protocol\n");
  }
  if (j["samples"].get<std::uint64_t>() > 0) {
    fmt::print("  rate       {:.2f} Hz, {} samples\n", j["rate_hz"].get<double>(), j["samples"].get<std::uint64_t>());
    fmt::print("  stamps     {:.2f} ms before arrival; jitter p50 {:.2f}, p99 {:.2f} ms\n",
               j["delay_p50_ms"].get<double>(), j["jitter_p50_ms"].get<double>(), j["jitter_p99_ms"].get<double>());
  }
  fmt::print("  faults     {} lost, {} damaged, {} dropped by the kernel, {} bus errors\n",
             j["lost"].get<std::uint64_t>(), j["damaged"].get<std::uint64_t>(), j["dropped"].get<std::uint64_t>(),
             j["bus_errors"].get<std::uint64_t>());
  if (!invalid.empty()) fmt::print("  validity   {}\n", invalid);
  if (!text("reason").empty() && text("state") != "streaming") fmt::print("  why        {}\n", text("reason"));
}

int complain(const Error& error, int exit_code) {
  fmt::print(stderr, "perimap probe: {}\n", error.message);
  return exit_code;
}

// One device while it is listened to.
struct Probed {
  const char* kind = "";
  std::string where;
  std::function<void(const Interrupt&)> serve;
  DeviceHealth health;
  Seen seen;
  int respiration_channel = 0;  // of an ECG device; 0: none
  SeenBreathing breathing;
  DeviceState state{};  // while the probe still ran: its own end closes the devices
};

void listen_to(const TrackerDevice& device, Probed& probed, const Interrupt& interrupt) {
  const TrackerSink sink = [&seen = probed.seen](const TrackerSample& sample) {
    seen.add(sample.source_time, 1);
    seen.delay.add(sample.arrival - sample.source_time);
    ++seen.tools[static_cast<std::size_t>(sample.state)];
    if (sample.state != ToolState::kOk) ++seen.invalid;
  };
  serve_tracker(device, sink, probed.health, interrupt);
}

void listen_to(const EcgDevice& device, Probed& probed, const Interrupt& interrupt) {
  const EcgSink ecg = [&seen = probed.seen](const EcgBlock& block) {
    seen.add(block.last_sample_time(), block.count);
    seen.delay.add(block.arrival - block.last_sample_time());
    if (block.lead_off) seen.invalid += block.count;
  };
  const RespirationSink respiration = [&probed](const RespirationBlock& block) { probed.breathing.add(block); };
  serve_ecg(device, {ecg, respiration}, probed.health, interrupt);
}

void listen_to(const RTriggerDevice& device, Probed& probed, const Interrupt& interrupt) {
  const RTriggerSink sink = [&seen = probed.seen](const RTriggerPulse& pulse) {
    seen.add(pulse.time, 1);
    seen.delay.add(pulse.arrival - pulse.time);
  };
  serve_r_trigger(device, sink, probed.health, interrupt);
}

void listen_to(const CameraDevice& device, Probed& probed, const Interrupt& interrupt) {
  GreyConverter converter;
  const CameraSink sink = [&seen = probed.seen, &converter](const CameraFrame& frame) {
    seen.add(frame.stamp.capture, 1);
    seen.delay.add(frame.stamp.arrival - frame.stamp.capture);
    if (!converter.convert(frame)) ++seen.invalid;
  };
  const auto served = serve_camera(device, sink, probed.health, interrupt);
  // A video that cannot be read says so in its health's reason.
  static_cast<void>(served);
}

template <class Device>
void add(std::vector<std::unique_ptr<Probed>>& all, const char* kind, const std::string& where, const Device& device) {
  all.push_back(std::make_unique<Probed>());
  Probed& probed = *all.back();
  probed.kind = kind;
  probed.where = where;
  probed.serve = [&device, &probed](const Interrupt& interrupt) { listen_to(device, probed, interrupt); };
}

int run(const Options& options) {
  auto stop = StopSignal::install();
  if (!stop) return complain(stop.error(), 1);
  auto configuration = load_configuration(options.file, {}, NamedFiles::kMayBeMissing);
  if (!configuration) return complain(configuration.error(), 2);
  // A playback is no device.
  configuration->camera.playback.reset();
  const auto devices = named_devices(*configuration, options.file);
  if (!devices) return complain({options.file + ": " + devices.error().message}, 2);
  std::vector<std::unique_ptr<Probed>> all;
  if (devices->camera) add(all, "camera", *configuration->camera.device, *devices->camera);
  if (devices->tracker) add(all, "tracker", format_endpoint(devices->tracker->endpoint), *devices->tracker);
  if (devices->ecg) {
    add(all, "ecg", format_endpoint(devices->ecg->endpoint), *devices->ecg);
    all.back()->respiration_channel = devices->ecg->respiration_channel;
  }
  if (devices->r_trigger) add(all, "r_trigger", devices->r_trigger->settings.path, *devices->r_trigger);
  if (all.empty()) {
    return complain(
        {options.file + ": names no device; expected keys 'camera.device', 'tracker.protocol' or 'ecg.protocol'"}, 2);
  }

  {
    Interrupt interrupt;
    std::vector<std::jthread> threads;
    threads.reserve(all.size());
    for (const auto& probed : all) {
      threads.emplace_back([&probed = *probed, &interrupt] { probed.serve(interrupt); });
    }
    if (stop->wait_for(from_seconds(options.seconds))) fmt::print(stderr, "perimap probe: stopped early\n");
    for (const auto& probed : all) probed->state = probed->health.state();
    interrupt.request();
  }
  nlohmann::json json;
  bool well = true;
  for (const auto& probed : all) {
    probed->health.set_state(probed->state);
    well = well && probed->state == DeviceState::kStreaming;
    json[probed->kind] = as_json(probed->kind, probed->health, probed->seen, probed->where);
    if (!options.json) print(probed->kind, json[probed->kind], complaint(probed->kind, probed->seen));
    if (probed->respiration_channel == 0) continue;
    nlohmann::json& breathing = json[probed->kind]["respiration"];
    breathing = as_json(probed->breathing, probed->respiration_channel);
    if (!options.json) print_breathing(breathing);
  }
  if (options.json) fmt::print("{}\n", json.dump(2));
  return well ? 0 : 1;
}

}  // namespace

void add_probe_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("probe", "Opens each device of a configuration and tells whether it is there and well");
  command->add_option("FILE", options->file, "Configuration of perimapd (TOML)")->required();
  command->add_option("--seconds", options->seconds, "How long to listen, s")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->add_flag("--json", options->json, "Print JSON");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace perimap
