// How far a program is, in one line.
#pragma once

#include <string>
#include <string_view>

#include "daemon/command_line/console.hpp"

namespace perimap {

// On standard error, the program's name before it. On a terminal each line is written over the one before; elsewhere it
// is one more, so that whoever calls show() does so seldom there.
class StatusLine {
 public:
  explicit StatusLine(const Console& console);
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;
  ~StatusLine();  // leaves the terminal's line

  [[nodiscard]] bool on_terminal() const noexcept { return on_terminal_; }
  void show(std::string_view line);

 private:
  Console console_;
  bool on_terminal_;
  bool open_ = false;
};

}  // namespace perimap
