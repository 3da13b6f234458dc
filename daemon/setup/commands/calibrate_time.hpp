// perimap calibrate time.
#pragma once

namespace perimap {

class Command;
class Commands;

void add_calibrate_time(Commands& commands, Command& calibrate);

}  // namespace perimap
