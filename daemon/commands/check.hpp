// `perimap check`: is a configuration right, and what does it come to?
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0, or 2 when the configuration is wrong.
void add_check_command(CLI::App& app, int& exit_code);

}  // namespace perimap
