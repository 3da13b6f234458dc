// perimap emulate: devices that exist in this machine alone, speaking the real protocols.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

void add_emulate_command(CLI::App& app, int& exit_code);

}  // namespace perimap
