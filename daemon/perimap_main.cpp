// perimap, the companion of perimapd. Exit codes: 0 done, 1 failed, 2 wrong usage or configuration.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "daemon/commands/check.hpp"
#include "daemon/commands/ctl.hpp"
#include "daemon/commands/probe.hpp"
#include "daemon/commands/record.hpp"
#include "daemon/evaluation/commands/bench.hpp"
#include "daemon/evaluation/commands/ecg.hpp"
#include "daemon/evaluation/commands/experiment.hpp"
#include "daemon/evaluation/commands/replay.hpp"
#include "daemon/evaluation/commands/report.hpp"
#include "daemon/evaluation/commands/track.hpp"
#include "daemon/evaluation/commands/watch.hpp"
#include "daemon/standins/commands/emulate.hpp"
#include "daemon/standins/commands/simulate.hpp"

namespace {

int run(int argc, char** argv) {
  CLI::App app("Companion of perimapd, which predicts where a beating organ's surface will be.");
  app.set_version_flag("--version", "perimap " PERIMAP_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 failed, 2 wrong usage or configuration.\n"
      "Research software, not a certified medical device.");
  int exit_code = 0;
  perimap::add_simulate_command(app, exit_code);
  perimap::add_replay_command(app, exit_code);
  perimap::add_watch_command(app, exit_code);
  perimap::add_report_command(app, exit_code);
  perimap::add_ecg_command(app, exit_code);
  perimap::add_bench_command(app, exit_code);
  perimap::add_experiment_command(app, exit_code);
  perimap::add_track_command(app, exit_code);
  perimap::add_emulate_command(app, exit_code);
  perimap::add_probe_command(app, exit_code);
  perimap::add_record_command(app, exit_code);
  perimap::add_check_command(app, exit_code);
  perimap::add_ctl_command(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "perimap: %s\n", error.what());
    return 1;
  }
}
