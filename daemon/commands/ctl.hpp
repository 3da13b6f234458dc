// `perimap ctl`: tells the perimapd that runs on this host what to do.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0, or 1 when perimapd was not reached or refused.
void add_ctl_command(CLI::App& app, int& exit_code);

}  // namespace perimap
