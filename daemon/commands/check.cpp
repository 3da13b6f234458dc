#include "daemon/commands/check.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/surface_traffic.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "daemon/runtime/thread_launcher.hpp"

namespace perimap {
namespace {

// What perimapd would ask of this machine and this user would not be given, on standard error: the configuration is
// sound all the same, and the service has limits of its own.
void tell_refused_privileges(const RealtimeConfiguration& realtime) {
  if (realtime.lock_memory && !memory_may_be_locked()) {
    fmt::print(stderr, "note: this user may not lock memory (realtime.lock_memory); perimapd would run on without\n");
  }
  ThreadLauncher threads({realtime.priority, realtime.cpus});
  threads.launch("privileges", ThreadRole::kPublisher, [] {}).join();
  threads.launch("privileges", ThreadRole::kSource, [] {}).join();
  if (threads.priority() == perimap_PRIVILEGE_REFUSED) {
    fmt::print(stderr,
               "note: this user is not given SCHED_FIFO priority {} on the processors asked for (realtime.priority, "
               "realtime.cpus); perimapd would run on without\n",
               realtime.priority);
  }
}

// The devices that it names, each with all its keys.
Expected<Configuration> load_whole(const std::string& file) {
  auto configuration = load_configuration(file);
  if (!configuration || configuration->replay.recording || !names_devices(*configuration)) return configuration;
  if (const auto devices = named_devices(*configuration, file); !devices) {
    return fail(file + ": " + devices.error().message);
  }
  return configuration;
}

}  // namespace

void add_check_command(CLI::App& app, int& exit_code) {
  const auto file = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(
      "check", "Checks a configuration file and prints the effective configuration, all keys with their meaning");
  command->add_option("FILE", *file, "Configuration of perimapd (TOML)")->required();
  command->callback([file, &exit_code] {
    const Expected<Configuration> configuration = load_whole(*file);
    if (configuration) {
      fmt::print("{}\n", to_toml(*configuration));
      for (const std::string& line : traffic_lines(*configuration)) fmt::print("# {}\n", line);
      tell_refused_privileges(configuration->realtime);
    } else {
      fmt::print(stderr, "{}\n", configuration.error().message);
    }
    exit_code = configuration ? 0 : 2;
  });
}

}  // namespace perimap
