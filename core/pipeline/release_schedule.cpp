#include "core/pipeline/release_schedule.hpp"

#include <algorithm>

namespace perimap {

namespace {

bool alike(Duration a, Duration b) noexcept { return 4 * std::max(a, b) <= 5 * std::min(a, b); }

// So much longer than usual that frames were missing without a gap in their numbers: a camera that is opened again
// counts on by one, however long it was away.
bool outage(Duration period, Duration usual) noexcept { return 2 * period > 5 * usual; }

}  // namespace

void ReleaseSchedule::fit(const FrameStamp& stamp) noexcept {
  if (have_fit_ && stamp.sequence > fitted_.sequence && stamp.capture > fitted_.capture) {
    const auto frames = static_cast<std::int64_t>(stamp.sequence - fitted_.sequence);
    fit((stamp.capture - fitted_.capture) / frames);
  }
  if (!have_fit_ || stamp.capture > fitted_.capture) fitted_ = stamp;
  have_fit_ = true;
}

void ReleaseSchedule::fit(Duration period) noexcept {
  constexpr int kAnotherRate = 4;
  if (period_ == Duration(0)) {
    period_ = period;
    return;
  }
  // Some alike in a row that are not as before: the rate is another one, or the first period was an outage.
  if (alike(period, period_)) {
    others_ = 0;
  } else {
    others_ = others_ > 0 && alike(period, other_period_) ? others_ + 1 : 1;
    other_period_ = period;
  }
  if (others_ == kAnotherRate) {
    others_ = 0;
    period_ = period;
  } else if (!outage(period, period_)) {
    // A slow average: stamps jitter by a fraction of a millisecond, the true period hardly changes.
    period_ += (period - period_) / 16;
  }
}

bool ReleaseSchedule::on_frame(const FrameStamp& stamp) noexcept {
  const bool backwards = have_fit_ && stamp.capture <= fitted_.capture;
  // Judged by the period that the release was taken by. That of a frame was taken for no other frame.
  const Duration around = last_missing_ ? period_ / 2 : Duration(0);
  const bool taken = have_last_ && stamp.capture <= last_capture_ + around;
  const bool near_taken = taken && stamp.capture > last_capture_ - around;
  fit(stamp);
  const Instant deadline = stamp.capture + latency_;
  if (backwards || taken || stamp.arrival > deadline || head_ - tail_ == kCapacity) {
    // Predictions go on from the true frame times, not from the ones fitted before this frame was known.
    if (near_taken) last_capture_ = stamp.capture;
    return false;
  }
  pending_[head_++ % kCapacity] = stamp;
  return true;
}

void ReleaseSchedule::resume(Instant last_capture, Duration period, Instant now) noexcept {
  if (period <= Duration(0)) return;
  const auto passed = std::max<std::int64_t>(0, (now - latency_ - last_capture) / period);
  have_last_ = true;
  last_missing_ = true;
  last_capture_ = last_capture + passed * period;
  period_ = period;
}

std::uint64_t ReleaseSchedule::pass_over(Instant now) noexcept {
  if (pending() || !have_last_ || period_ <= Duration(0) || now <= last_capture_ + latency_) return 0;
  const auto passed = (now - latency_ - last_capture_) / period_;
  last_missing_ = last_missing_ || passed > 0;
  last_capture_ += passed * period_;
  if (numbered_) last_sequence_ += static_cast<std::uint64_t>(passed);
  return static_cast<std::uint64_t>(passed);
}

std::optional<Release> ReleaseSchedule::next() const noexcept {
  if (have_last_ && period_ > Duration(0)) {
    const Instant expected = last_capture_ + period_;
    // A pending frame stands for the expected one when it is within half a period of it; else one is missing before.
    if (!pending() || pending_[tail_ % kCapacity].capture > expected + period_ / 2) {
      return Release{numbered_ ? last_sequence_ + 1 : 0, expected, expected + latency_, true};
    }
  }
  if (!pending()) return std::nullopt;
  const FrameStamp& stamp = pending_[tail_ % kCapacity];
  return Release{stamp.sequence, stamp.capture, stamp.capture + latency_, false};
}

Release ReleaseSchedule::take_release() noexcept {
  const Release release = *next();
  if (!release.frame_missing) {
    ++tail_;
    numbered_ = true;
  }
  have_last_ = true;
  last_missing_ = release.frame_missing;
  last_capture_ = release.capture;
  last_sequence_ = release.frame_sequence;
  return release;
}

}  // namespace perimap
