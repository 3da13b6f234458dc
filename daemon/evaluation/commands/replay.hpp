// `perimap replay`: the pipeline over a recording, in real time or in lockstep, with its accuracy and latencies.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0; 1 when the recording is damaged or could not be read or a
// file could not be written; 2 when an option or the configuration was wrong.
void add_replay_command(CLI::App& app, int& exit_code);

}  // namespace perimap
