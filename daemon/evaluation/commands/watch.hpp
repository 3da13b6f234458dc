// `perimap watch`: a DDS subscriber in the terminal.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0; 1 when no surface came, or DDS or the recording failed.
void add_watch_command(CLI::App& app, int& exit_code);

}  // namespace perimap
