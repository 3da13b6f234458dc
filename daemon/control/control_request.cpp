#include "daemon/control/control_request.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

namespace perimap {
namespace {

constexpr std::array<std::pair<std::string_view, ControlCommand>, 6> kCommands{
    {{"status", ControlCommand::kStatus},
     {"new-patient", ControlCommand::kNewPatient},
     {"organ-moved", ControlCommand::kOrganMoved},
     {"record on", ControlCommand::kRecordOn},
     {"record off", ControlCommand::kRecordOff},
     {"reload", ControlCommand::kReload}}};

std::string printable(std::string_view bytes) {
  std::string text;
  for (const char c : bytes) {
    if (c >= ' ' && c <= '~') {
      text += c;
    } else {
      text += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    }
  }
  return text;
}

}  // namespace

std::string_view name_of(ControlCommand command) noexcept {
  for (const auto& [name, value] : kCommands) {
    if (value == command) return name;
  }
  return "unknown";
}

Expected<ControlCommand> parse_control_request(std::string_view request) {
  if (request.size() > kLongestRequest) {
    return fail(fmt::format("expected a command of at most {} bytes, got {}", kLongestRequest, request.size()));
  }
  if (!request.ends_with('\n')) {
    return fail(fmt::format("expected a command and a newline, got '{}'", printable(request)));
  }
  const std::string_view word = request.substr(0, request.size() - 1);
  for (const auto& [name, command] : kCommands) {
    if (word == name) return command;
  }
  return fail(fmt::format("expected one of status, new-patient, organ-moved, record on, record off, reload, got '{}'",
                          printable(word)));
}

}  // namespace perimap
