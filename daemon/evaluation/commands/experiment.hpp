// `perimap experiment`: the paper's two experiments, as tables and figures.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0; 1 when a file could not be written; 2 when an option was
// wrong.
void add_experiment_command(CLI::App& app, int& exit_code);

}  // namespace perimap
