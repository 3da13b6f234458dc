// `perimap check`: whether a configuration file is sound, and what it comes to.
#include <fmt/format.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "daemon/command_line/commands.hpp"
#include "daemon/config/configuration_loader.hpp"
#include "daemon/config/configuration_text.hpp"
#include "daemon/config/surface_traffic.hpp"
#include "daemon/keys/key_folder.hpp"
#include "daemon/keys/role.hpp"
#include "daemon/runtime/calibration_fit.hpp"
#include "daemon/runtime/device_setup.hpp"
#include "daemon/runtime/last_verification.hpp"
#include "daemon/runtime/setup_warnings.hpp"
#include "daemon/runtime/thread_launcher.hpp"

namespace perimap {
namespace {

// What perimapd would ask of this machine and this user would not be given: the configuration is sound all the same,
// and the service has limits of its own.
void tell_refused_privileges(const RealtimeConfiguration& realtime, const Console& console) {
  if (realtime.lock_memory && !memory_may_be_locked()) {
    console.complain("note: this user may not lock memory (realtime.lock_memory); perimapd would run on without");
  }
  ThreadLauncher threads({realtime.priority, realtime.cpus});
  threads.launch("privileges", ThreadRole::kPublisher, [] {}).join();
  threads.launch("privileges", ThreadRole::kSource, [] {}).join();
  if (threads.priority() == perimap_PRIVILEGE_REFUSED) {
    console.complain(fmt::format(
        "note: this user is not given SCHED_FIFO priority {} on the processors asked for (realtime.priority, "
        "realtime.cpus); perimapd would run on without",
        realtime.priority));
  }
}

WrongKeys wrong_security(const Configuration& configuration) {
  if (!configuration.dds.security) return {};
  const auto keys = check_keys(*configuration.dds.security, seconds_now());
  if (!keys) return {{"dds.security", keys.error().message}};
  if (keys->certificate.role == rights_of(KeyRole::kPublisher).name) return {};
  return {{"dds.security", "expected keys of a publisher, got those of a " + std::string(keys->certificate.role)}};
}

// The devices that it names, each with all its keys.
Expected<Configuration> load_whole(const std::string& file) {
  auto configuration = load_configuration(file);
  if (!configuration) return configuration;
  WrongKeys wrong = wrong_frames(*configuration, file);
  append(wrong, wrong_calibrations(*configuration));
  append(wrong, wrong_security(*configuration));
  if (!configuration->replay.recording && names_devices(*configuration)) {
    if (auto devices = named_devices(*configuration, file); !devices) append(wrong, std::move(devices.error()));
  }
  if (!wrong.empty()) return tl::unexpected(told_in(file, std::move(wrong)));
  return configuration;
}

Outcome check(const std::string& file, const Console& console) {
  const Expected<Configuration> configuration = load_whole(file);
  if (!configuration) return refuse(configuration.error(), ExitCode::kWrongUsage);
  fmt::print("{}\n", to_toml(*configuration));
  for (const std::string& line : traffic_lines(*configuration)) fmt::print("# {}\n", line);
  for (const std::string& line : setup_warnings(*configuration)) console.complain("warning: " + line);
  if (const LastVerification last = last_verification(file, *configuration); last.doubtful) {
    console.complain("warning: " + last.line);
  } else if (!last.line.empty()) {
    fmt::print("# {}\n", last.line);
  }
  if (configuration->dds.security) {
    const auto keys = check_keys(*configuration->dds.security, seconds_now());
    const auto warning = keys ? expiry_warning(*keys, seconds_now()) : std::nullopt;
    if (warning) console.complain("warning: " + *warning);
  }
  tell_refused_privileges(configuration->realtime, console);
  return {};
}

}  // namespace

void add_check_command(Commands& commands) {
  const auto file = std::make_shared<std::string>();
  Command& command = commands.add(
      "check", "Checks a configuration file and prints the effective configuration, all keys with their meaning",
      [file](const Console& console) { return check(*file, console); });
  command.add_option("FILE", *file, "Configuration of perimapd (TOML)")->required();
}

}  // namespace perimap
