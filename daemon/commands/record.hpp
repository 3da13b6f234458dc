// `perimap record`: what the devices of a configuration give, as it comes, into a recording.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0 when everything was recorded, 1 when something was not, 2 when
// the configuration is wrong.
void add_record_command(CLI::App& app, int& exit_code);

}  // namespace perimap
