// `perimap probe`: is each configured device there, and well?
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0 when every device delivers, 1 when one does not, 2 when the
// configuration is wrong.
void add_probe_command(CLI::App& app, int& exit_code);

}  // namespace perimap
