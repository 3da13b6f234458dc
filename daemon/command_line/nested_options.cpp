#include "daemon/command_line/nested_options.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <sstream>

#include "daemon/command_line/arguments.hpp"
#include "daemon/command_line/command.hpp"

namespace perimap {

Expected<void> parse_nested_options(const std::vector<std::string>& words,
                                    const std::function<void(Command&)>& add_options) {
  CLI::App app;
  app.set_help_flag();
  Command options(app);
  add_options(options);
  try {
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
    return {};
  } catch (const CLI::ParseError& error) {
    return fail(fmt::format("{}", fmt::join(what_is_wrong(app, error), "\n")));
  }
}

Error told_of_option(const std::string& option, const Error& error) {
  std::istringstream lines(error.message);
  std::string told;
  for (std::string line; std::getline(lines, line);) {
    told += fmt::format("{}{}: {}", told.empty() ? "" : "\n", option, line);
  }
  return {told};
}

}  // namespace perimap
