// `perimap bench`: the latency benchmark, and the subscriber that it runs in another process.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommands. When one has run, `exit_code` is 0; 1 when the recording, DDS or a file failed.
void add_bench_command(CLI::App& app, int& exit_code);

}  // namespace perimap
