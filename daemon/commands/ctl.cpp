#include "daemon/commands/ctl.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/control/control_server.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

struct Options {
  std::string socket = "/run/perimap/control";
  bool json = false;
};

// Of a nested object, a line each leaf: "stages_ms.dds_write.p50: 0.07".
void print_lines(const Json& json, const std::string& prefix) {
  for (const auto& [key, value] : json.items()) {
    if (value.is_object()) {
      print_lines(value, prefix + key + ".");
    } else {
      fmt::print("{}{}: {}\n", prefix, key, value.is_string() ? value.get<std::string>() : value.dump());
    }
  }
}

int tell(const Options& options, const std::string& command) {
  const Expected<std::string> answer = ask_control(options.socket, command);
  if (!answer) {
    fmt::print(stderr, "perimap ctl: {}\n", answer.error().message);
    return 1;
  }
  const Json json = command == "status" && !options.json ? Json::parse(*answer, nullptr, false) : Json();
  if (json.is_object()) {
    print_lines(json, "");
  } else {
    fmt::print("{}", *answer);
  }
  return 0;
}

}  // namespace

void add_ctl_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("ctl", "Tells the perimapd that runs on this host what to do");
  command->add_option("--socket", options->socket, "Where it takes commands (control.socket)")->capture_default_str();
  command->require_subcommand(1);
  CLI::App* status = command->add_subcommand("status", "What it publishes, its sources, and how long each stage takes");
  status->add_flag("--json", options->json, "Machine-readable, one line");
  status->callback([options, &exit_code] { exit_code = tell(*options, "status"); });
  command->add_subcommand("new-patient", "Clears the map, and what is known of the heart's rhythm")
      ->callback([options, &exit_code] { exit_code = tell(*options, "new-patient"); });
  CLI::App* record = command->add_subcommand("record", "Begins to record what the devices give, or ends the recording");
  record->require_subcommand(1);
  record->add_subcommand("on", "Into a new file of recording.folder")->callback([options, &exit_code] {
    exit_code = tell(*options, "record on");
  });
  record->add_subcommand("off", "Once all that has come is in the file")->callback([options, &exit_code] {
    exit_code = tell(*options, "record off");
  });
  command->add_subcommand("reload", "Reads the configuration again; says what needs a restart")
      ->callback([options, &exit_code] { exit_code = tell(*options, "reload"); });
}

}  // namespace perimap
