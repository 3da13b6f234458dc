#include "daemon/commands/check.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "daemon/config/configuration_loader.hpp"

namespace perimap {

void add_check_command(CLI::App& app, int& exit_code) {
  const auto file = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(
      "check", "Checks a configuration file and prints the effective configuration, all keys with their meaning");
  command->add_option("FILE", *file, "Configuration of perimapd (TOML)")->required();
  command->callback([file, &exit_code] {
    const Expected<Configuration> configuration = load_configuration(*file);
    if (configuration) {
      fmt::print("{}", to_toml(*configuration));
    } else {
      fmt::print(stderr, "{}\n", configuration.error().message);
    }
    exit_code = configuration ? 0 : 2;
  });
}

}  // namespace perimap
