// When each part of each frame's life happened, and on which thread: for looking at single frames after a run.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/pipeline/release_schedule.hpp"
#include "core/realtime/fixed_log.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What the mapper and its workers do of a frame. The stages have the names that the benchmark's figures have.
enum class FramePart : std::uint8_t {
  kAwaitPose,  // the mapper waits for the tracker to reach the capture
  kPredictAndFind,
  kFindOthers,  // a worker's, after the scouts
  kPhaseAndPose,
  kEvaluate,
  kSettleMatches,
  kHandOn,
  kLearn  // of the mapper's: from its beginning until the last worker has done
};

[[nodiscard]] constexpr std::string_view name_of(FramePart part) noexcept {
  switch (part) {
    case FramePart::kAwaitPose:
      return "await pose";
    case FramePart::kPredictAndFind:
      return "predict and find";
    case FramePart::kFindOthers:
      return "find others";
    case FramePart::kPhaseAndPose:
      return "phase and pose";
    case FramePart::kEvaluate:
      return "evaluate";
    case FramePart::kSettleMatches:
      return "settle matches";
    case FramePart::kHandOn:
      return "hand on";
    case FramePart::kLearn:
      return "learn";
  }
  return "";
}

struct FrameSlice {
  std::uint64_t frame = 0;  // FrameStamp::sequence
  FramePart part = FramePart::kAwaitPose;
  Instant begin;
  Instant end;
};

// A frame was taken over from the thread that brought it.
struct TracedArrival {
  FrameStamp stamp;
  Instant begin;
  Instant end;  // its pixels are copied, and the mapper knows
};

// A surface was published.
struct TracedRelease {
  Release release;
  bool update_late = false;
  Instant begin;     // of composing it
  Instant composed;  // and then it waited for its deadline
  Instant ready;     // just before the write
  Instant written;   // the write has returned
};

// Of one run. Each log has one writing thread.
struct FrameTrace {
  // Room for so many frames, and of so many workers.
  FrameTrace(std::size_t frames, int team)
      : arrivals(frames),
        mapper(kPartsOfAFrame * frames),
        workers(static_cast<std::size_t>(team), FixedLog<FrameSlice>(kPartsOfAFrame * frames)),
        releases(kReleasesAFrame * frames) {}

  FixedLog<TracedArrival> arrivals;
  FixedLog<FrameSlice> mapper;
  std::vector<FixedLog<FrameSlice>> workers;  // by their number
  FixedLog<TracedRelease> releases;           // of both streams

  [[nodiscard]] std::uint64_t left_out() const noexcept {
    std::uint64_t sum = arrivals.left_out() + mapper.left_out() + releases.left_out();
    for (const FixedLog<FrameSlice>& worker : workers) sum += worker.left_out();
    return sum;
  }

 private:
  static constexpr std::size_t kPartsOfAFrame = 8;
  static constexpr std::size_t kReleasesAFrame = 5;  // the clock of 1000/s beside the frames
};

// Notes what its life spans; nothing where there is no log.
class FrameSpan {
 public:
  FrameSpan(FixedLog<FrameSlice>* log, FramePart part, std::uint64_t frame) noexcept
      : log_(log), part_(part), frame_(frame), begin_(log != nullptr ? MonotonicClock::now() : Instant{}) {}
  FrameSpan(const FrameSpan&) = delete;
  FrameSpan& operator=(const FrameSpan&) = delete;
  ~FrameSpan() {
    if (log_ != nullptr) log_->add({frame_, part_, begin_, MonotonicClock::now()});
  }

 private:
  FixedLog<FrameSlice>* log_;
  FramePart part_;
  std::uint64_t frame_;
  Instant begin_;
};

}  // namespace perimap
