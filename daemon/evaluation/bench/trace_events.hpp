// The lives of a run's frames as trace events, the JSON text that Perfetto, chrome://tracing and others open.
#pragma once

#include <optional>
#include <string>

#include "core/pipeline/frame_trace.hpp"
#include "core/time/instant.hpp"

namespace perimap::bench {

// Events one a line, with a comma between them and none at the end; instants are microseconds since `zero`, right to
// the nanosecond. Those who read them take them for double numbers, so that `zero` must be no more than weeks before.
// The run is the process with this number, 1 or more, and this name.
//
// Threads: `source` takes a frame over, `mapper` has a slice a frame with the stages in it, `worker-0` and so on
// theirs, `publisher` composes a surface, waits for its deadline and writes it. Each slice tells its frame, and arrows
// lead from a frame's taking over to its stages and to its surface. Beside the threads each frame has a track `frame`,
// from its capture to when its surface was written, and one `learn`.
//
// After the run has ended. `counted_from`: from when on releases are counted in the run's figures.
[[nodiscard]] std::string trace_events(int process, const std::string& name, const FrameTrace& trace,
                                       std::optional<Instant> counted_from, Instant zero);

}  // namespace perimap::bench
