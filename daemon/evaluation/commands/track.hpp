// `perimap track`: the visual front end alone, over a video or the frames of a recording.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

// Adds the subcommand. When it has run, `exit_code` is 0; 1 when the input could not be read or an output not be
// written; 2 when an option was wrong.
void add_track_command(CLI::App& app, int& exit_code);

}  // namespace perimap
