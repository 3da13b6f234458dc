// perimap calibrate hand-eye.
#pragma once

namespace perimap {

class Command;
class Commands;

void add_calibrate_hand_eye(Commands& commands, Command& calibrate);

}  // namespace perimap
