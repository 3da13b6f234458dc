#include "daemon/commands/probe.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <atomic>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/process/stop_signal.hpp"
#include "daemon/runtime/device_feeder.hpp"
#include "daemon/runtime/device_setup.hpp"

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

double milliseconds(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

// What the tool or the lead says, when it is not well.
std::string complaint(const char* kind, const Seen& seen) {
  if (seen.invalid == 0) return "";
  if (std::string_view(kind) == "ecg") return fmt::format("lead off in {} of {} samples", seen.invalid, seen.count);
  return fmt::format("tool missing in {}, out of volume in {}, disabled in {} of {} readings", seen.tools[1],
                     seen.tools[2], seen.tools[3], seen.count);
}

nlohmann::json as_json(const DeviceHealth& health, const Seen& seen, const std::string& where) {
  const auto jitter = health.jitter.summary();
  return {{"where", where},
          {"state", device_state_name(health.state())},
          {"reason", health.reason()},
          {"identity", health.identity()},
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

void print(const char* kind, const nlohmann::json& j, const std::string& invalid) {
  const auto text = [&j](const char* key) { return j[key].get<std::string>(); };
  fmt::print("{} at {}: {}\n", kind, text("where"), text("state"));
  if (!text("identity").empty()) fmt::print("  identity   {}\n", text("identity"));
  if (j["samples"].get<std::uint64_t>() > 0) {
    fmt::print("  rate       {:.2f} Hz, {} samples\n", j["rate_hz"].get<double>(), j["samples"].get<std::uint64_t>());
    fmt::print("  stamps     {:.2f} ms before arrival; jitter p50 {:.2f}, p99 {:.2f} ms\n",
               j["delay_p50_ms"].get<double>(), j["jitter_p50_ms"].get<double>(), j["jitter_p99_ms"].get<double>());
    fmt::print("  faults     {} lost, {} damaged, {} dropped by the kernel, {} bus errors\n",
               j["lost"].get<std::uint64_t>(), j["damaged"].get<std::uint64_t>(), j["dropped"].get<std::uint64_t>(),
               j["bus_errors"].get<std::uint64_t>());
  }
  if (!invalid.empty()) fmt::print("  validity   {}\n", invalid);
  if (!text("reason").empty() && text("state") != "streaming") fmt::print("  why        {}\n", text("reason"));
}

int complain(const Error& error, int exit_code) {
  fmt::print(stderr, "perimap probe: {}\n", error.message);
  return exit_code;
}

int run(const Options& options) {
  auto stop = StopSignal::install();
  if (!stop) return complain(stop.error(), 1);
  const auto configuration = load_configuration(options.file, {}, NamedFiles::kMayBeMissing);
  if (!configuration) return complain(configuration.error(), 2);
  const bool has_tracker = configuration->tracker.protocol != TrackerConfiguration::Protocol::kNone;
  const bool has_ecg = configuration->ecg.protocol != EcgConfiguration::Protocol::kNone;
  if (!has_tracker && !has_ecg) {
    return complain({options.file + ": names no device; expected keys 'tracker.protocol' or 'ecg.protocol'"}, 2);
  }
  Expected<TrackerDevice> tracker = fail("");
  Expected<EcgDevice> ecg = fail("");
  if (has_tracker) tracker = tracker_device(configuration->tracker);
  if (has_tracker && !tracker) return complain({options.file + ": " + tracker.error().message}, 2);
  if (has_ecg) ecg = ecg_device(configuration->ecg);
  if (has_ecg && !ecg) return complain({options.file + ": " + ecg.error().message}, 2);

  Interrupt interrupt;
  DeviceHealth tracker_health;
  DeviceHealth ecg_health;
  Seen tracker_seen;
  Seen ecg_seen;
  // The state while the probe still ran: its own end closes the devices.
  DeviceState tracker_state{};
  DeviceState ecg_state{};
  {
    std::jthread reading_tracker;
    std::jthread reading_ecg;
    if (has_tracker) {
      reading_tracker = std::jthread([&] {
        const TrackerSink sink = [&](const TrackerSample& sample) {
          tracker_seen.add(sample.source_time, 1);
          tracker_seen.delay.add(sample.arrival - sample.source_time);
          ++tracker_seen.tools[static_cast<std::size_t>(sample.state)];
          if (sample.state != ToolState::kOk) ++tracker_seen.invalid;
        };
        serve_tracker(*tracker, sink, tracker_health, interrupt);
      });
    }
    if (has_ecg) {
      reading_ecg = std::jthread([&] {
        const EcgSink sink = [&](const EcgBlock& block) {
          const Instant last = block.first_sample_time + (block.count - 1) * block.sample_period;
          ecg_seen.add(last, block.count);
          ecg_seen.delay.add(block.arrival - last);
          if (block.lead_off) ecg_seen.invalid += block.count;
        };
        serve_ecg(*ecg, sink, ecg_health, interrupt);
      });
    }
    if (stop->wait_for(from_seconds(options.seconds))) fmt::print(stderr, "perimap probe: stopped early\n");
    tracker_state = tracker_health.state();
    ecg_state = ecg_health.state();
    interrupt.request();
  }
  tracker_health.set_state(tracker_state);
  ecg_health.set_state(ecg_state);

  nlohmann::json all;
  if (has_tracker) all["tracker"] = as_json(tracker_health, tracker_seen, format_endpoint(tracker->endpoint));
  if (has_ecg) all["ecg"] = as_json(ecg_health, ecg_seen, format_endpoint(ecg->endpoint));
  if (options.json) {
    fmt::print("{}\n", all.dump(2));
  } else {
    if (has_tracker) print("tracker", all["tracker"], complaint("tracker", tracker_seen));
    if (has_ecg) print("ecg", all["ecg"], complaint("ecg", ecg_seen));
  }
  const bool well =
      (!has_tracker || tracker_state == DeviceState::kStreaming) && (!has_ecg || ecg_state == DeviceState::kStreaming);
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
