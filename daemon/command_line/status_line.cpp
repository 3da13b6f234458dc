#include "daemon/command_line/status_line.hpp"

#include <unistd.h>

#include <cstdio>

namespace perimap {

StatusLine::StatusLine(const Console& console) : console_(console), on_terminal_(isatty(STDERR_FILENO) == 1) {}

StatusLine::~StatusLine() {
  if (open_) (void)std::fputs("\n", stderr);
}

void StatusLine::show(std::string_view line) {
  if (!on_terminal_) {
    console_.complain(line);
    return;
  }
  const std::string whole = "\r" + console_.name() + ": " + std::string(line) + "\x1b[K";
  (void)std::fwrite(whole.data(), 1, whole.size(), stderr);
  (void)std::fflush(stderr);
  open_ = true;
}

}  // namespace perimap
