#include "core/pipeline/pose_trust.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace perimap {
namespace {

// Bit for bit: a sensor has noise, so what it gives twice is old.
bool same_pose(const Pose& a, const Pose& b) noexcept { return a.t == b.t && a.R == b.R; }
// But where it shows nothing at all: a lens that is covered is black, and all its noise is cut off.
bool same_picture(const GreyImage& a, const GreyImage& b) noexcept {
  if (a.data == nullptr || b.data == nullptr || a.width != b.width || a.height != b.height) return false;
  bool plain = true;
  for (int y = 0; y < a.height; ++y) {
    if (std::memcmp(a.row(y), b.row(y), static_cast<std::size_t>(a.width)) != 0) return false;
    const auto differs = [first = *a.row(0)](std::uint8_t pixel) { return pixel != first; };
    plain = plain && std::none_of(a.row(y), a.row(y) + a.width, differs);
  }
  return !plain;
}

// What holds of frames from either on, holds from the earlier one on.
void since_earlier(std::optional<std::uint64_t>& since, std::uint64_t frame_index) noexcept {
  since = since ? std::min(*since, frame_index) : frame_index;
}

}  // namespace

void PoseTrust::add(const TrackerSample& sample) noexcept {
  const bool valid = sample.state == ToolState::kOk;
  const bool repeated = valid && last_reading_ && same_pose(*last_reading_, sample.X_WS);
  if (repeated) counters_.poses_repeated.add();
  // By arrival: a tracker that has stopped may stamp as if it had not.
  pose_repeats_.add(repeated, sample.arrival);
  last_reading_ = valid ? std::optional(sample.X_WS) : std::nullopt;
  if (!poses_.add(sample)) counters_.poses_refused.add();
  last_arrival_ = std::max(last_arrival_, sample.arrival);
  if (scope_ != nullptr) scope_->add_pose(sample);
}

void PoseTrust::add_second(const TrackerSample& sample) noexcept {
  if (scope_ != nullptr) scope_->add_second_pose(sample);
}

PoseTrust::Told PoseTrust::begin_frame(FrameRecord& frame, const FrameHistory& history, const GreyImage& image,
                                       const GreyImage& before) noexcept {
  Told told;
  const bool came_lately = !may_loop_ && loop_.seen_before(image, frame.stamp.capture);
  frame.repeated = came_lately || same_picture(image, before);
  heed_repeats(frame, history, told);
  bool known = !doubts_.pose_repeated;
  double turn_deviation_rad = 0.0;
  if (scope_ != nullptr) {
    const ScopeWatch::Frame scope = scope_->begin_frame(frame.index, frame.stamp.capture, image);
    if (scope.mistaken_since) since_earlier(told.mistaken_since, *scope.mistaken_since);
    if (scope.mistaken_from) since_earlier(told.mistaken_since, history.first_since(*scope.mistaken_from));
    doubts_.scope_unread = scope.unread;
    doubts_.scope_changed = scope.changed;
    known = known && !scope.unread && !scope.changed;
    if (scope.state) {
      poses_.set_hand_eye(scope.state->X_SC);
      frame.picture = scope.state->picture;
      turn_deviation_rad = scope.state->rotation_deviation_rad;
    }
  }
  if (known) told.pose = poses_.at(frame.stamp.capture);
  told.pose.rotation_variance_rad2 += turn_deviation_rad * turn_deviation_rad;
  parallax_.add(told.pose, frame.stamp.capture);
  doubts_.still = parallax_.none();
  return told;
}

// What is given again and again is old. A tracker that has said one pose all along may be one that keeps still.
void PoseTrust::heed_repeats(const FrameRecord& frame, const FrameHistory& history, Told& told) noexcept {
  if (frame.repeated) counters_.frames_repeated.add();
  picture_repeats_.add(frame.repeated, frame.stamp.capture);
  doubts_.picture_repeated = picture_repeats_.long_enough();
  const bool stuck = pose_repeats_.long_enough() && parallax_.ever();
  if (stuck && !doubts_.pose_repeated) since_earlier(told.mistaken_since, history.first_since(pose_repeats_.since()));
  doubts_.pose_repeated = stuck;
}

}  // namespace perimap
