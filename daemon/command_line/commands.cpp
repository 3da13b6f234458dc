#include "daemon/command_line/commands.hpp"

#include <CLI/CLI.hpp>
#include <utility>

#include "daemon/command_line/arguments.hpp"
#include "daemon/command_line/open_files.hpp"

namespace perimap {
namespace {

std::string full_name(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  return parent == nullptr ? command.get_name() : full_name(*parent) + " " + command.get_name();
}

}  // namespace

Commands::Commands(const std::string& program, const std::string& version, const std::string& description,
                   const std::string& footer)
    : app_(std::make_unique<CLI::App>(description, program)), program_(std::make_unique<Command>(*app_)) {
  app_->set_version_flag("--version", program + " " + version);
  app_->require_subcommand(1);
  app_->footer(footer);
}

Commands::~Commands() = default;

Command& Commands::keep(CLI::App& command) { return *commands_.emplace_back(std::make_unique<Command>(command)); }

Command& Commands::add(const std::string& name, const std::string& description, Run run) {
  return add(*program_, name, description, std::move(run));
}

Command& Commands::add_group(const std::string& name, const std::string& description) {
  return add_group(*program_, name, description);
}

Command& Commands::add_group(Command& group, const std::string& name, const std::string& description) {
  CLI::App* command = group.app().add_subcommand(name, description);
  command->require_subcommand(1);
  return keep(*command);
}

Command& Commands::add(Command& group, const std::string& name, const std::string& description, Run run) {
  CLI::App* command = group.app().add_subcommand(name, description);
  // Nothing is done before all is parsed.
  command->callback([this, command, run = std::move(run)] {
    chosen_ = [command, &run] {
      const Console console(full_name(*command));
      if (const auto enough = ensure_open_files(); !enough) return console.end(refuse(enough.error()));
      return console.end(run(console));
    };
  });
  return keep(*command);
}

int Commands::run(int argc, const char* const* argv) {
  if (const auto ended = parse_arguments(*app_, argc, argv)) return *ended;
  return chosen_();
}

int run_program(const std::string& name, const std::string& version, const std::string& description,
                const std::function<void(Command&)>& add_options, const Commands::Run& run, int argc,
                const char* const* argv) {
  CLI::App app(description, name);
  app.set_version_flag("--version", name + " " + version);
  Command options(app);
  add_options(options);
  if (const auto ended = parse_arguments(app, argc, argv)) return *ended;
  const Console console(name);
  if (const auto enough = ensure_open_files(); !enough) return console.end(refuse(enough.error()));
  return console.end(run(console));
}

}  // namespace perimap
