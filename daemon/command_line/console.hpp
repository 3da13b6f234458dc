// What a program says beside its results.
#pragma once

#include <string>
#include <string_view>

#include "daemon/command_line/outcome.hpp"

namespace perimap {

// Results go to standard output; everything else goes to standard error through this, StatusLine or Logging, the
// program's name before each line, so that it can be told from what other programs of a script say. (The journal knows
// the program itself.) Any thread may call it: lines stay whole.
class Console {
 public:
  // `name`: "perimapd", "perimap replay".
  explicit Console(std::string name) : name_(std::move(name)) {}

  // A message may have several lines, such as all that is wrong with a configuration.
  void complain(std::string_view message) const;
  void complain(const Error& error) const { complain(error.message); }

  // Tells what was refused, if that has not been told; what the program ends with.
  [[nodiscard]] int end(const Outcome& outcome) const;

  [[nodiscard]] const std::string& name() const noexcept { return name_; }

 private:
  std::string name_;
};

}  // namespace perimap
