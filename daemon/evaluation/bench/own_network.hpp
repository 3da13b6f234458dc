// A benchmark's surfaces among its own processes.
#pragma once

namespace perimap::bench {

// On this host alone where the environment has no settings of Cyclone DDS. What the user has set holds, so that it is
// measured; but apart from every other participant, whatever its domain: a surface of a benchmark must not reach those
// who navigate by another. Cyclone DDS reads it when the first participant is made, children inherit it. Call it before
// other threads begin: it writes the environment.
void keep_to_ourselves();

}  // namespace perimap::bench
