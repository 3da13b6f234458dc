// What a recording's surfaces were worth, over all of it: for the time line.
#pragma once

#include <perimap.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"
#include "drivers/recording/recording_reader.hpp"

namespace perimap {

struct StateSpan {
  Instant begin;
  Instant end;
  perimap_SurfaceState state = perimap_SURFACE_INVALID;
};

struct PublishedStates {
  std::string stream;  // "frame" where there is one; empty: there are no surfaces
  std::vector<StateSpan> spans;
  // Of the first frames that surfaces of that stream rest on: number and capture.
  std::map<std::uint64_t, Instant> captures;
  bool statuses = false;      // there is a perimap::Status
  std::vector<Error> damage;  // of the file
};

// Reads all surfaces of a recording, of a damaged one those that are whole. A span ends where nothing came for 0.4 s.
[[nodiscard]] Expected<PublishedStates> read_published_states(const std::string& file);

// What has to be added to the instants of a recording of devices to have those of surfaces that were published while it
// was replayed, or zero when they were published as it was recorded. None: no surface is of one of its frames.
[[nodiscard]] Expected<std::optional<Duration>> offset_to(const PublishedStates& states, const std::string& recording);

}  // namespace perimap
