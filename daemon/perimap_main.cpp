// perimap: the companion command line of perimapd.
#include <CLI/CLI.hpp>

#include "daemon/commands/replay.hpp"
#include "daemon/commands/simulate.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Tools around perimapd, which maps a beating organ. Research software, not a certified medical device.",
               "perimap"};
  app.set_version_flag("--version", PERIMAP_VERSION);
  app.require_subcommand(1);
  int exit_code = 0;
  perimap::add_simulate_command(app, exit_code);
  perimap::add_replay_command(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return exit_code;
}
