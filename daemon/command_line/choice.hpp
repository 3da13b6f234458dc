// Options whose value is one of a few words.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "daemon/command_line/command.hpp"

namespace perimap {

// The help names the words and a wrong one is told them.
template <class Value>
Option* add_choice(Command& command, const std::string& option, Value& value,
                   const std::map<std::string, Value>& choices, const std::string& description) {
  OneOf words({});
  for (const auto& [word, stands_for] : choices) words.words.push_back(word);
  return command
      .add_option_function<std::string>(
          option, [&value, choices](const std::string& word) { value = choices.at(word); }, description)
      ->check(words);
}

}  // namespace perimap
