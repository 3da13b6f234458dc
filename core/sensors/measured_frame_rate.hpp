// The rate of frames, from the instants of their capture.
#pragma once

#include <array>
#include <cstddef>

#include "core/time/frame_rate.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// The middle one of the last intervals. Frames that are missing, come twice or out of order do not tell in it while
// they are fewer than the others. Until enough intervals are known it is the usual rate, and it stays what it is until
// the intervals say clearly another one: what is counted by it needs to be no surer, and stamps that jitter do not move
// it. A pure function of the instants: a replay has the same rate at the same frame every time. No heap.
class MeasuredFrameRate {
 public:
  void add(Instant capture) noexcept;

  [[nodiscard]] const FrameRate& rate() const noexcept { return rate_; }

 private:
  static constexpr std::size_t kIntervals = 15;
  static constexpr std::size_t kEnough = 8;
  static constexpr double kAnother = 0.1;  // share of the rate: 30 and 25 frames/s are two, 30 and 29.97 one

  FrameRate rate_;
  std::array<double, kIntervals> intervals_s_{};
  std::size_t count_ = 0;
  bool any_ = false;
  Instant newest_;
};

}  // namespace perimap
