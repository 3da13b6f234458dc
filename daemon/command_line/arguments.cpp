#include "daemon/command_line/arguments.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <utility>

#include "core/error/nearest_name.hpp"
#include "core/error/one_line.hpp"
#include "daemon/command_line/console.hpp"

namespace perimap {
namespace {

// The innermost command that was given, and its name with those around it: "perimap ctl record".
struct Given {
  const CLI::App* command;
  std::string name;
};

Given innermost(const CLI::App& app) {
  Given given{&app, app.get_name()};
  while (!given.command->get_subcommands().empty()) {
    given.command = given.command->get_subcommands().front();
    given.name += " " + given.command->get_name();
  }
  return given;
}

std::vector<std::string> commands_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    // A group of options is a command without a name; one without a group is not for users.
    if (!command->get_name().empty() && !command->get_group().empty()) names.push_back(command->get_name());
  }
  return names;
}

std::vector<std::string> options_of(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  for (const CLI::App* group :
       app.get_subcommands([](const CLI::App* command) { return command->get_name().empty(); })) {
    const auto more = options_of(*group);
    names.insert(names.end(), more.begin(), more.end());
  }
  return names;
}

// A line for each argument that is none. After a command that is none, nothing else can be told.
std::vector<std::string> unknown_arguments(const CLI::App& app) {
  std::vector<std::string> told;
  const auto commands = commands_of(app);
  bool follows_option = false;
  for (const std::string& argument : app.remaining()) {
    // What follows an option that is none may be its value.
    const bool may_be_value =
        std::exchange(follows_option, argument.starts_with('-') && argument.find('=') == std::string::npos);
    if (argument.starts_with('-')) {
      const std::string name = argument.substr(0, argument.find('='));
      told.push_back(fmt::format("{}: is no option{}", argument, did_you_mean(name, options_of(app))));
    } else if (!commands.empty()) {
      told.push_back(fmt::format("'{}': is no command{}", argument, did_you_mean(argument, commands)));
      break;
    } else if (!may_be_value) {
      told.push_back(fmt::format("'{}': is one argument too many", argument));
    }
  }
  return told;
}

}  // namespace

std::vector<std::string> what_is_wrong(const CLI::App& command, const CLI::ParseError& error) {
  std::vector<std::string> lines = unknown_arguments(command);
  // What is missing is missing because of what is misspelt, as often as not.
  if (lines.empty()) lines.emplace_back(error.what());
  for (std::string& line : lines) line = on_one_line(line);
  return lines;
}

std::optional<int> parse_arguments(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(error);
    const Given given = innermost(app);
    const Console console(given.name);
    for (const std::string& line : what_is_wrong(*given.command, error)) console.complain(line);
    console.complain(given.name + " --help tells how it is used");
    return static_cast<int>(ExitCode::kWrongUsage);
  }
}

}  // namespace perimap
