// `perimap report`: what a subscriber received, against the truth of a simulated recording.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0; 1 when a file could not be read or written; 2 when an option
// was wrong.
void add_report_command(CLI::App& app, int& exit_code);

}  // namespace perimap
