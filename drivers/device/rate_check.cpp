#include "drivers/device/rate_check.hpp"

#include <cmath>

namespace perimap {

void RateCheck::begin(std::int64_t count, Instant arrival) noexcept {
  begin_count_ = last_count_ = count;
  begin_ = last_ = arrival;
}

void RateCheck::observe(std::int64_t count, Instant arrival) noexcept {
  if (!started_ || count < last_count_ || arrival - last_ > kLongestGap) {
    started_ = true;
    before_ = 0;
    return begin(count, arrival);
  }
  last_count_ = count;
  last_ = arrival;
  if (arrival - begin_ < kWindow) return;
  seen_hz_ = static_cast<double>(count - begin_count_) / to_seconds(arrival - begin_);
  const double off = seen_hz_ / nominal_hz_ - 1.0;
  const int now = std::abs(off) <= kTolerance ? 0 : off > 0.0 ? 1 : -1;
  if (now == 0) wrong_ = false;
  if (now != 0 && now == before_) wrong_ = true;
  before_ = now;
  begin(count, arrival);
}

}  // namespace perimap
