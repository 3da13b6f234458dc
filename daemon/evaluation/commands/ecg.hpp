// `perimap ecg`: the beats of an ECG as the daemon would find them, and how right they are.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0, 1 when it failed, or 2 when the usage was wrong.
void add_ecg_command(CLI::App& app, int& exit_code);

}  // namespace perimap
