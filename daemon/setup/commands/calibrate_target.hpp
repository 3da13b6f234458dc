// perimap calibrate target.
#pragma once

namespace perimap {

class Command;
class Commands;

void add_calibrate_target(Commands& commands, Command& calibrate);

}  // namespace perimap
