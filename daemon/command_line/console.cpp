#include "daemon/command_line/console.hpp"

#include <cstdio>

namespace perimap {

void Console::complain(std::string_view message) const {
  std::string lines;
  while (!message.empty()) {
    const std::size_t end = message.find('\n');
    lines += name_ + ": " + std::string(message.substr(0, end)) + "\n";
    message = end == std::string_view::npos ? std::string_view() : message.substr(end + 1);
  }
  // One call, so that two threads' lines do not mix. Where nobody reads it there is nothing left to do.
  (void)std::fwrite(lines.data(), 1, lines.size(), stderr);
}

int Console::end(const Outcome& outcome) const {
  if (outcome) return static_cast<int>(ExitCode::kDone);
  complain(outcome.error().error);
  return static_cast<int>(outcome.error().code);
}

}  // namespace perimap
