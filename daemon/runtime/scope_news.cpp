#include "daemon/runtime/scope_news.hpp"

#include <spdlog/spdlog.h>

#include <chrono>

#include "core/angle/angle.hpp"

namespace perimap {

void ScopeNews::tell(const PipelineCounters& counters, Instant now) {
  const bool changed = counters.scope_changed.get() != 0;
  if (changed && !changed_) {
    spdlog::warn(
        "the scope has been turned in its camera head or zoomed, and no calibration of its turns is named "
        "(camera.turned_scope): its hand-eye is not right any more, frames have no pose until it is as it was; "
        "`perimap calibrate scope` measures its turns");
  }
  if (!changed && changed_) spdlog::info("the scope is turned and zoomed as at first again");
  changed_ = changed;
  tell_of_reading(counters, now);
}

// Where the turns are calibrated: frames are counted as unread there alone.
void ScopeNews::tell_of_reading(const PipelineCounters& counters, Instant now) {
  constexpr Duration kLong = std::chrono::seconds(2);
  const std::uint64_t unread = counters.scope_frames_unread.get();
  const bool read = counters.scope_read.get() != 0;
  if (read || unread == unread_) last_read_ = now;
  const bool news = unread != unread_;
  unread_ = unread;
  if (news && !unread_told_ && now - last_read_ > kLong) {
    unread_told_ = true;
    known_ = false;
    spdlog::warn(
        "how the scope is turned in its camera head is not known ({} frames so far): they have no pose until the field "
        "stop with its notch is seen, at a zoom that was calibrated; or, where a second sensor tells, until the "
        "tracker "
        "sees both sensors, fast where they were",
        unread);
  }
  const std::uint64_t turns = counters.scope_turns.get();
  const double rotation_deg = 1e-6 * static_cast<double>(counters.scope_rotation_urad.get()) / kDegree;
  const bool calibrated = unread > 0;  // the first frames are never read
  if (calibrated && read && (!known_ || turns != turns_)) {
    spdlog::info("the scope is turned by {:.1f} degrees: hand-eye and lens are as calibrated for that", rotation_deg);
    known_ = true;
    unread_told_ = false;
  }
  turns_ = turns;
}

}  // namespace perimap
