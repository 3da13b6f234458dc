// `perimap ctl`: tells the perimapd that runs on this host what to do.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/command_line/commands.hpp"
#include "daemon/control/control_server.hpp"
#include "drivers/json/json_text.hpp"

namespace perimap {
namespace {

using Json = nlohmann::ordered_json;

struct CtlOptions {
  std::string socket = "/run/perimap/control";
  bool json = false;
};

// Of a nested object, a line each leaf: "stages_ms.dds_write.p50: 0.07".
void print_lines(const Json& json, const std::string& prefix) {
  for (const auto& [key, value] : json.items()) {
    if (value.is_object()) {
      print_lines(value, prefix + key + ".");
    } else {
      fmt::print("{}{}: {}\n", prefix, key, value.is_string() ? value.get<std::string>() : json_line(value));
    }
  }
}

Outcome tell(const CtlOptions& options, const std::string& command) {
  const Expected<std::string> answer = ask_control(options.socket, command);
  if (!answer) return refuse(answer.error());
  const Json json = command == "status" && !options.json ? Json::parse(*answer, nullptr, false) : Json();
  if (json.is_object()) {
    print_lines(json, "");
  } else {
    fmt::print("{}", *answer);
  }
  return {};
}

}  // namespace

void add_ctl_command(Commands& commands) {
  const auto options = std::make_shared<CtlOptions>();
  const auto telling = [&options](const std::string& command) {
    return [options, command](const Console&) { return tell(*options, command); };
  };
  Command& ctl = commands.add_group("ctl", "Tells the perimapd that runs on this host what to do");
  ctl.add_option("--socket", options->socket, "Where it takes commands (control.socket)")->capture_default_str();
  commands.add(ctl, "status", "What it publishes, its sources, and how long each stage takes", telling("status"))
      .add_flag("--json", options->json, "Machine-readable, one line");
  commands.add(ctl, "new-patient", "Clears the map, and what is known of the heart's rhythm", telling("new-patient"));
  commands.add(ctl, "organ-moved", "Moves the map, with its motions, to where the images show the organ now",
               telling("organ-moved"));
  Command& record = commands.add_group(ctl, "record", "Begins to record what the devices give, or ends the recording");
  commands.add(record, "on", "Into a new file of recording.folder", telling("record on"));
  commands.add(record, "off", "Once all that has come is in the file", telling("record off"));
  commands.add(ctl, "reload", "Reads the configuration again; says what needs a restart", telling("reload"));
}

}  // namespace perimap
