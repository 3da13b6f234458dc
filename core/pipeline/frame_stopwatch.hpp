// How long a frame's stages take, for the status and for what has to be shed.
#pragma once

#include <utility>

#include "core/pipeline/pipeline_counters.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Each member when that has ended, in their order. Used by the mapper thread.
class FrameStopwatch {
 public:
  // `captures_are_live`: a capture lies on this machine's clock, not on a recording's. The counters must outlive it.
  FrameStopwatch(PipelineCounters& counters, bool captures_are_live) noexcept
      : counters_(counters), captures_are_live_(captures_are_live) {}

  void begin() noexcept { begun_ = last_ = MonotonicClock::now(); }
  void found() noexcept { counters_.predict_and_find.add(lap()); }
  void settled() noexcept { counters_.phase_and_pose.add(lap()); }
  void evaluated(Instant capture) noexcept {
    counters_.evaluate.add(lap());
    if (captures_are_live_) counters_.capture_to_update.add(last_ - capture);
  }
  // A to C, and the rest of the search.
  void matches_settled() noexcept { computed_ = MonotonicClock::now() - begun_; }
  [[nodiscard]] Duration computed() const noexcept { return computed_; }

  void learning_begun() noexcept {
    learn_started_ = MonotonicClock::now();
    learning_ = true;
  }
  // The workers were joined, the last of which had done at `ended`; whatever else they learn is another frame's.
  // Whether any learning was under way.
  bool learnt(Instant ended) noexcept {
    if (ended > learn_started_) {
      counters_.learn.add(ended - learn_started_);
      counters_.frame_compute.add(computed_ + (ended - learn_started_));
    }
    return std::exchange(learning_, false);
  }

 private:
  Duration lap() noexcept {
    const Instant before = std::exchange(last_, MonotonicClock::now());
    return last_ - before;
  }

  PipelineCounters& counters_;
  bool captures_are_live_;
  Instant begun_;
  Instant last_;
  Duration computed_{0};
  Instant learn_started_;
  bool learning_ = false;
};

}  // namespace perimap
