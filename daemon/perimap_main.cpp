// perimap, the companion of perimapd. Exit codes: 0 done, 1 failed, 2 wrong usage or configuration.
#include <csignal>
#include <cstdio>
#include <exception>

#include "daemon/command_line/commands.hpp"

// A command is one file in a folder `commands`, which defines add_NAME_command(), and one line here, in the order of
// perimap --help.
// NOLINTBEGIN(cppcoreguidelines-macro-usage): only the preprocessor makes names.
#define PERIMAP_COMMANDS(COMMAND) \
  COMMAND(simulate)               \
  COMMAND(replay)                 \
  COMMAND(watch)                  \
  COMMAND(view)                   \
  COMMAND(bridge)                 \
  COMMAND(report)                 \
  COMMAND(session)                \
  COMMAND(export_view)            \
  COMMAND(ecg)                    \
  COMMAND(bench)                  \
  COMMAND(experiment)             \
  COMMAND(track)                  \
  COMMAND(judge)                  \
  COMMAND(emulate)                \
  COMMAND(setup)                  \
  COMMAND(probe)                  \
  COMMAND(record)                 \
  COMMAND(check)                  \
  COMMAND(calibrate)              \
  COMMAND(register)               \
  COMMAND(refine)                 \
  COMMAND(verify)                 \
  COMMAND(ctl)                    \
  COMMAND(keys)                   \
  COMMAND(forget)                 \
  COMMAND(verify_log)

namespace perimap {

#define PERIMAP_DECLARE(NAME) void add_##NAME##_command(Commands& commands);
PERIMAP_COMMANDS(PERIMAP_DECLARE)
#undef PERIMAP_DECLARE

namespace {

int run(int argc, char** argv) {
  // A file that may not grow is an error like a full disk, and told like one.
  (void)std::signal(SIGXFSZ, SIG_IGN);
  Commands commands("perimap", PERIMAP_VERSION,
                    "Companion of perimapd, which predicts where a beating organ's surface will be.",
                    "Exit codes: 0 done, 1 failed, 2 wrong usage or configuration.\n"
                    "Research software, not a certified medical device.");
#define PERIMAP_ADD(NAME) add_##NAME##_command(commands);
  PERIMAP_COMMANDS(PERIMAP_ADD)
#undef PERIMAP_ADD
  // NOLINTEND(cppcoreguidelines-macro-usage)
  return commands.run(argc, argv);
}

}  // namespace
}  // namespace perimap

int main(int argc, char** argv) {
  try {
    return perimap::run(argc, argv);
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "perimap: %s\n", error.what());
    return 1;
  }
}
