#include "core/sensors/measured_frame_rate.hpp"

#include <algorithm>
#include <cmath>

#include "core/statistics/upper_median.hpp"

namespace perimap {

void MeasuredFrameRate::add(Instant capture) noexcept {
  const double interval_s = any_ ? to_seconds(capture - newest_) : 0.0;
  any_ = true;
  newest_ = capture;
  if (interval_s <= 0.0) return;
  intervals_s_[count_++ % kIntervals] = interval_s;
  if (count_ < kEnough) return;
  auto sorted = intervals_s_;
  const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(std::min(count_, kIntervals));
  const FrameRate lately(1.0 / upper_median(sorted.begin(), end));
  if (std::abs(lately.per_s() / rate_.per_s() - 1.0) > kAnother) rate_ = lately;
}

}  // namespace perimap
