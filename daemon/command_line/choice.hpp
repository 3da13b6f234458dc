// Options whose value is one of a few words.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>

namespace perimap {

// The help names the words and a wrong one is told them; CLI11's own transformers print the values that stand for them.
template <class Value>
CLI::Option* add_choice(CLI::App& command, const std::string& option, Value& value,
                        const std::map<std::string, Value>& choices, const std::string& description) {
  return command
      .add_option_function<std::string>(
          option, [&value, choices](const std::string& word) { value = choices.at(word); }, description)
      ->check(CLI::IsMember(choices));
}

}  // namespace perimap
