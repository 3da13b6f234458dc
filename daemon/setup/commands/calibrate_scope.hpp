// perimap calibrate scope.
#pragma once

namespace perimap {

class Command;
class Commands;

void add_calibrate_scope(Commands& commands, Command& calibrate);

}  // namespace perimap
