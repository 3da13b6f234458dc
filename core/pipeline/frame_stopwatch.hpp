// How long a frame's stages take, for the status, for what has to be shed, and for a trace where one is kept.
#pragma once

#include <cstdint>
#include <utility>

#include "core/pipeline/frame_trace.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Each member when that has ended, in their order. Used by the mapper thread.
class FrameStopwatch {
 public:
  // `captures_are_live`: a capture lies on this machine's clock, not on a recording's. The counters must outlive it,
  // and so must `log`, null where no trace is kept.
  FrameStopwatch(PipelineCounters& counters, bool captures_are_live, FixedLog<FrameSlice>* log) noexcept
      : counters_(counters), captures_are_live_(captures_are_live), log_(log) {}

  void begin(std::uint64_t frame) noexcept {
    frame_ = frame;
    begun_ = last_ = MonotonicClock::now();
  }
  void found() noexcept { counters_.predict_and_find.add(lap(FramePart::kPredictAndFind)); }
  void settled() noexcept { counters_.phase_and_pose.add(lap(FramePart::kPhaseAndPose)); }
  void evaluated(Instant capture) noexcept {
    counters_.evaluate.add(lap(FramePart::kEvaluate));
    if (captures_are_live_) counters_.capture_to_update.add(last_ - capture);
  }
  // A to C, and the rest of the search.
  void matches_settled() noexcept {
    lap(FramePart::kSettleMatches);
    computed_ = last_ - begun_;
  }
  [[nodiscard]] Duration computed() const noexcept { return computed_; }

  void learning_begun() noexcept {
    lap(FramePart::kHandOn);
    learn_started_ = last_;
    learning_ = true;
  }
  // The workers were joined, the last of which had done at `ended`; whatever else they learn is another frame's.
  // Whether any learning was under way.
  bool learnt(Instant ended) noexcept {
    if (ended > learn_started_) {
      counters_.learn.add(ended - learn_started_);
      counters_.frame_compute.add(computed_ + (ended - learn_started_));
      note(FramePart::kLearn, learn_started_, ended);
    }
    return std::exchange(learning_, false);
  }

 private:
  Duration lap(FramePart part) noexcept {
    const Instant before = std::exchange(last_, MonotonicClock::now());
    note(part, before, last_);
    return last_ - before;
  }
  void note(FramePart part, Instant begin, Instant end) noexcept {
    if (log_ != nullptr) log_->add({frame_, part, begin, end});
  }

  PipelineCounters& counters_;
  bool captures_are_live_;
  FixedLog<FrameSlice>* log_;
  std::uint64_t frame_ = 0;
  Instant begun_;
  Instant last_;
  Duration computed_{0};
  Instant learn_started_;
  bool learning_ = false;
};

}  // namespace perimap
