// What the log says of how the scope is turned in its camera head.
#pragma once

#include <cstdint>

#include "core/pipeline/pipeline_counters.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Once for each change, and not for single frames. Called now and then, by one thread.
class ScopeNews {
 public:
  void tell(const PipelineCounters& counters, Instant now);

 private:
  void tell_of_reading(const PipelineCounters& counters, Instant now);

  bool known_ = false;
  bool unread_told_ = false;
  bool changed_ = false;
  std::uint64_t turns_ = 0;
  std::uint64_t unread_ = 0;
  Instant last_read_;
};

}  // namespace perimap
