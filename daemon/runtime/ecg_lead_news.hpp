// What the log says of two leads of the ECG: which of them is off.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "core/pipeline/pipeline_counters.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// A line for each change that lasts two seconds. Of one lead alone there are none: the phase says what it lacks.
class EcgLeadNews {
 public:
  struct Line {
    bool warning = false;
    std::string text;
  };

  // Some times a second, `now` rising: the line that is due, if any.
  [[nodiscard]] std::optional<Line> next(const PipelineCounters& counters, Instant now);

 private:
  struct Lead {
    bool off = false;
    bool told_off = false;
    Instant since;  // it has been so
  };
  std::array<Lead, 2> leads_;
};

}  // namespace perimap
