#include "core/pipeline/release_plan.hpp"

#include <algorithm>
#include <utility>

namespace perimap {

bool ReleasePlan::on_frame(const FrameStamp& stamp, Instant now) noexcept {
  if (settings_.frame_stream) {
    // Up to the last frame that is known: what comes after it may be told by the stamps to come.
    while (frames_.pending() && missed(frames_.next(), now)) leave_out_frame();
  } else {
    // What nobody takes off the schedule would fill it between two releases of a slow clock.
    let_frames_come_due(stamp.arrival);
  }
  return frames_.on_frame(stamp);
}

std::optional<Release> ReleasePlan::next() const noexcept {
  const std::optional<Release> frame = settings_.frame_stream ? frames_.next() : std::nullopt;
  const std::optional<Instant> grid = next_on_grid();
  if (frame && (!grid || frame->deadline <= *grid)) return frame;
  if (!grid) return std::nullopt;
  return Release{due_.frame_sequence, due_.capture, *grid, due_.frame_missing, ReleaseStream::kClock};
}

Release ReleasePlan::take_release() noexcept {
  Release release = *next();
  if (release.stream == ReleaseStream::kFrame) {
    take_frame();
    return due_;
  }
  let_frames_come_due(release.deadline);
  grid_begun_ = true;
  last_on_grid_ = release.deadline;
  return {due_.frame_sequence, due_.capture, release.deadline, due_.frame_missing, ReleaseStream::kClock};
}

MissedReleases ReleasePlan::leave_out_missed(Instant now) noexcept {
  while (settings_.frame_stream && missed(frames_.next(), now)) leave_out_frame();
  const std::optional<Instant> grid = next_on_grid();
  if (grid && grid_begun_ && now >= *grid + settings_.clock_period) {
    const auto passed = (now - *grid) / settings_.clock_period;
    last_on_grid_ += passed * settings_.clock_period;
    missed_[index_of(ReleaseStream::kClock)] += static_cast<std::uint64_t>(passed);
  }
  return std::exchange(missed_, {});
}

std::uint64_t ReleasePlan::pass_over(Instant now) noexcept {
  const std::uint64_t frames = frames_.pass_over(now);
  std::uint64_t passed = settings_.frame_stream ? frames : 0;
  const std::optional<Instant> grid = next_on_grid();
  if (grid && grid_begun_ && now >= *grid) {
    const auto of_clock = (now - *grid) / settings_.clock_period + 1;
    last_on_grid_ += of_clock * settings_.clock_period;
    passed += static_cast<std::uint64_t>(of_clock);
  }
  return passed;
}

bool ReleasePlan::missed(const std::optional<Release>& frame, Instant now) const noexcept {
  if (!frame) return false;
  const Duration period = frames_.period();
  return stale(*frame, now) || (period > Duration(0) && now - frame->deadline >= kMostTogether * period);
}

void ReleasePlan::leave_out_frame() noexcept {
  take_frame();
  ++missed_[index_of(ReleaseStream::kFrame)];
}

void ReleasePlan::take_frame() noexcept {
  any_due_ = true;
  due_ = frames_.take_release();
  if (!due_.frame_missing) owed_ = due_.frame_sequence;
}

void ReleasePlan::let_come_due(Instant now) noexcept {
  if (settings_.frame_stream) return;
  // Not what comes due after the clock's next release: of a publisher that was held up that one is still to be made.
  const std::optional<Instant> grid = next_on_grid();
  if (grid) let_frames_come_due(std::min(now, *grid));
}

std::optional<Instant> ReleasePlan::next_on_grid() const noexcept {
  const Duration period = settings_.clock_period;
  if (period <= Duration(0)) return std::nullopt;
  if (grid_begun_) return last_on_grid_ + period;
  const std::optional<Release> first = any_due_ ? due_ : frames_.next();
  if (!first) return std::nullopt;
  return Instant((first->deadline.time_since_epoch() + period - Duration(1)) / period * period);
}

void ReleasePlan::let_frames_come_due(Instant until) noexcept {
  for (auto frame = frames_.next(); frame && frame->deadline <= until; frame = frames_.next()) {
    take_frame();
  }
}

}  // namespace perimap
