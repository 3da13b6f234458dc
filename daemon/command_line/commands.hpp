// The commands of a program: each is options, one library call, text.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "daemon/command_line/command.hpp"
#include "daemon/command_line/console.hpp"
#include "daemon/command_line/outcome.hpp"

namespace CLI {
class App;
}

namespace perimap {

class Commands {
 public:
  // What a command does once its options are parsed.
  using Run = std::function<Outcome(const Console&)>;

  Commands(const std::string& program, const std::string& version, const std::string& description,
           const std::string& footer);
  Commands(const Commands&) = delete;
  Commands& operator=(const Commands&) = delete;
  ~Commands();

  // The command's own options are added to what this returns.
  Command& add(const std::string& name, const std::string& description, Run run);
  // A command of commands, such as `ctl`, and one of its own.
  Command& add_group(const std::string& name, const std::string& description);
  Command& add_group(Command& group, const std::string& name, const std::string& description);
  Command& add(Command& group, const std::string& name, const std::string& description, Run run);

  // Parses what was typed and does it; returns the program's exit code.
  [[nodiscard]] int run(int argc, const char* const* argv);

 private:
  [[nodiscard]] Command& keep(CLI::App& command);

  std::unique_ptr<CLI::App> app_;
  std::unique_ptr<Command> program_;
  std::vector<std::unique_ptr<Command>> commands_;
  std::function<int()> chosen_;
};

// A program without commands: its options are added, parsed, and then it runs; returns its exit code.
[[nodiscard]] int run_program(const std::string& name, const std::string& version, const std::string& description,
                              const std::function<void(Command&)>& add_options, const Commands::Run& run, int argc,
                              const char* const* argv);

}  // namespace perimap
