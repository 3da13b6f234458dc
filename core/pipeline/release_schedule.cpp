#include "core/pipeline/release_schedule.hpp"

#include <algorithm>

namespace perimap {

void ReleaseSchedule::fit(const FrameStamp& stamp) noexcept {
  if (have_fit_ && stamp.sequence > fitted_.sequence && stamp.capture > fitted_.capture) {
    const auto frames = static_cast<std::int64_t>(stamp.sequence - fitted_.sequence);
    const Duration period = (stamp.capture - fitted_.capture) / frames;
    // A slow average: stamps jitter by a fraction of a millisecond, the true period hardly changes.
    period_ = period_ == Duration(0) ? period : period_ + (period - period_) / 16;
  }
  if (!have_fit_ || stamp.capture > fitted_.capture) fitted_ = stamp;
  have_fit_ = true;
}

bool ReleaseSchedule::on_frame(const FrameStamp& stamp, Instant now) noexcept {
  const bool backwards = have_fit_ && stamp.capture <= fitted_.capture;
  fit(stamp);
  const Instant deadline = stamp.capture + latency_;
  const bool taken = have_last_ && stamp.capture <= last_capture_ + period_ / 2;
  if (backwards || taken || now > deadline || head_ - tail_ == kCapacity) {
    // Predictions go on from the true frame times, not from the ones fitted before this frame was known.
    if (taken && stamp.capture > last_capture_ - period_ / 2) last_capture_ = stamp.capture;
    return false;
  }
  pending_[head_++ % kCapacity] = stamp;
  return true;
}

void ReleaseSchedule::resume(Instant last_capture, std::uint64_t last_sequence, Duration period, Instant now) noexcept {
  if (period <= Duration(0)) return;
  const auto passed = std::max<std::int64_t>(0, (now - latency_ - last_capture) / period);
  have_last_ = true;
  last_capture_ = last_capture + passed * period;
  last_sequence_ = last_sequence + static_cast<std::uint64_t>(passed);
  period_ = period;
}

std::optional<Release> ReleaseSchedule::next() const noexcept {
  if (have_last_ && period_ > Duration(0)) {
    const Instant expected = last_capture_ + period_;
    // A pending frame stands for the expected one when it is within half a period of it; else one is missing before.
    if (!pending() || pending_[tail_ % kCapacity].capture > expected + period_ / 2) {
      return Release{last_sequence_ + 1, expected, expected + latency_, true};
    }
  }
  if (!pending()) return std::nullopt;
  const FrameStamp& stamp = pending_[tail_ % kCapacity];
  return Release{stamp.sequence, stamp.capture, stamp.capture + latency_, false};
}

Release ReleaseSchedule::take() noexcept {
  const Release release = *next();
  if (!release.frame_missing) ++tail_;
  have_last_ = true;
  last_capture_ = release.capture;
  last_sequence_ = release.frame_sequence;
  return release;
}

}  // namespace perimap
