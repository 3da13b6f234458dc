// perimap calibrate camera.
#pragma once

namespace CLI {
class App;
}

namespace perimap {

class Commands;

void add_calibrate_camera(Commands& commands, CLI::App& calibrate);

}  // namespace perimap
