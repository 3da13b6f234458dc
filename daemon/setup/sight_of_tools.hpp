// Whether the tracker sees the tools that a live calibration needs.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Of one thread at a time.
class SightOfTools {
 public:
  // `named`: in the words for the user, as "the pointer". None was seen before `begin`.
  SightOfTools(std::vector<std::string> named, Instant begin);

  // A reading of the tool with this place among the named ones.
  void take(std::size_t tool, const TrackerSample& sample);
  // What to do about tools that have not been seen for a second; empty: all are seen.
  [[nodiscard]] std::string missing(Instant now) const;

 private:
  struct Tool {
    std::string name;
    Instant seen;
  };
  std::vector<Tool> tools_;
};

}  // namespace perimap
