// `perimap simulate`: writes a recording of a beating heart with its ground truth.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0; 1 when the recording could not be written; 2 when an option
// was wrong.
void add_simulate_command(CLI::App& app, int& exit_code);

}  // namespace perimap
