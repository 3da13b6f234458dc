// perimap calibrate camera.
#pragma once

namespace perimap {

class Command;
class Commands;

void add_calibrate_camera(Commands& commands, Command& calibrate);

}  // namespace perimap
