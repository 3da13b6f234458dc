// Files that a command is to write.
#pragma once

#include <string>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct Output {
  std::string option;  // that names it: "--json"
  std::string file;    // empty: none was asked for
};

struct Input {
  std::string name;  // as the message is to call it: "the recording itself"
  std::string file;
};

// Before the work begins: that none of the outputs is what is read, by any name, nor another output. An error is wrong
// usage.
[[nodiscard]] Expected<void> check_apart(const std::vector<Output>& outputs, const std::vector<Input>& inputs);

// Likewise, that each can be written: nobody wants to hear of that when the work is done.
[[nodiscard]] Expected<void> check_writable(const std::vector<Output>& outputs);

}  // namespace perimap
