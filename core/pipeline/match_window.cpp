#include "core/pipeline/match_window.hpp"

#include <algorithm>

namespace perimap {
namespace {

// On either side; a hand's sway bends little in it, and a tracker's noise of 1.4 mm leaves some 4 mm/s at 30 frames/s.
constexpr Duration kTwistWithin = std::chrono::milliseconds(170);

}  // namespace

void MatchWindow::add(const FrameRecord& frame, std::span<const FeatureSlot> slots) noexcept {
  const Instant capture = frame.stamp.capture;
  if (!frame.measurable) return;
  if (begin_ != end_ && capture < frames_[(end_ - 1) % kFrames].capture) clear();
  // Half a frame's time early is on time, and what one frame is late the next is not: so many a second on the whole.
  const Duration early = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(0.5 / frame.rate.per_s()));
  if (begin_ == end_ || capture - due_ > kEvery) due_ = capture;
  if (capture + early < due_) return;
  due_ += kEvery;
  if (end_ - begin_ == kFrames) ++begin_;
  WindowFrame& added = frames_[end_ % kFrames];
  std::size_t& count = counts_[end_ % kFrames];
  added.state = WindowFrame::State::kOpen;
  added.index = frame.index;
  added.capture = capture;
  count = 0;
  for (std::size_t slot = 0; slot < slots.size(); ++slot) {
    const FeatureSlot& of = slots[slot];
    if (of.state == SlotState::kEmpty || of.match.state != MatchState::kFound || of.pressed) continue;
    // As the lens model has it: a scope that is turned or zoomed moves the picture, and is no wrong lens.
    matches_[(end_ % kFrames) * slots_ + count++] = {slot, of.id, frame.picture.to_lens(of.match.px),
                                                     frame.picture.covariance_to_lens(of.match.covariance_px2)};
  }
  ++end_;
}

void MatchWindow::tell(const FrameHistory& history) noexcept {
  if (begin_ == end_) return;
  // By the frame of now: what was measurable long ago is not judged again and again.
  const Instant now = history.newest()->stamp.capture;
  while (begin_ != end_ && now - frame(begin_).capture > kLength) ++begin_;
  for (std::uint64_t number = begin_; number != end_; ++number) {
    WindowFrame& open = frames_[number % kFrames];
    if (open.state != WindowFrame::State::kOpen) continue;
    const FrameRecord* record = history.find(open.index);
    if (record == nullptr || !record->measurable || (record->phase.exact && !record->phase.teaches)) {
      open.state = WindowFrame::State::kUseless;
      continue;
    }
    if (!record->phase.exact) return;
    open.X_WC = record->pose.X_WC;
    open.lever_W_mm = record->pose.lever_W_mm;
    open.tracker_variance_mm2 = record->tracker_variance_mm2;
    open.rotation_variance_rad2 = record->pose.rotation_variance_rad2;
    open.phase = record->phase;
    open.respiration = record->respiration;
    open.twist = camera_twist(history, *record);
    open.state = WindowFrame::State::kTold;
  }
}

void MatchWindow::disown(std::uint64_t since_frame) noexcept {
  for (std::uint64_t number = begin_; number != end_; ++number) {
    WindowFrame& told = frames_[number % kFrames];
    if (told.index >= since_frame) told.state = WindowFrame::State::kUseless;
  }
}

void MatchWindow::retell_phases(const CardiacClock& clock) noexcept {
  for (std::uint64_t number = begin_; number != end_; ++number) {
    WindowFrame& told = frames_[number % kFrames];
    if (told.state != WindowFrame::State::kTold) continue;
    told.phase = clock.at(told.capture);
    // It has left the clock's memory.
    if (!told.phase.exact || !told.phase.teaches) told.state = WindowFrame::State::kUseless;
  }
}

void MatchWindow::retell_respiration(const RespiratoryClock& respiration) noexcept {
  for (std::uint64_t number = begin_; number != end_; ++number) {
    WindowFrame& told = frames_[number % kFrames];
    if (told.state == WindowFrame::State::kTold) told.respiration = respiration.at(told.capture);
  }
}

std::uint64_t MatchWindow::newest_told() const noexcept {
  for (std::uint64_t number = end_; number != begin_; --number) {
    const WindowFrame& told = frames_[(number - 1) % kFrames];
    if (told.state == WindowFrame::State::kTold) return told.index;
  }
  return 0;
}

std::size_t MatchWindow::told() const noexcept {
  std::size_t count = 0;
  for (std::uint64_t number = begin_; number != end_; ++number) {
    count += frame(number).state == WindowFrame::State::kTold ? 1 : 0;
  }
  return count;
}

CameraTwist camera_twist(const FrameHistory& history, const FrameRecord& frame) noexcept {
  const Matrix3d R_CW = frame.pose.X_WC.R.transpose();
  double n = 0.0, sum_t = 0.0, sum_tt = 0.0;
  Vector3d sum_p = Vector3d::Zero(), sum_tp = Vector3d::Zero(), sum_w = Vector3d::Zero(), sum_tw = Vector3d::Zero();
  const auto add = [&](const FrameRecord& other) {
    if (!other.pose.valid()) return;
    const double t_s = to_seconds(other.stamp.capture - frame.stamp.capture);
    const Vector3d p = R_CW * (other.pose.X_WC.t - frame.pose.X_WC.t);
    const Vector3d w = so3_log(R_CW * other.pose.X_WC.R);
    n += 1.0;
    sum_t += t_s;
    sum_tt += t_s * t_s;
    sum_p += p;
    sum_tp += t_s * p;
    sum_w += w;
    sum_tw += t_s * w;
  };
  add(frame);
  for (std::uint64_t i = 1;; ++i) {
    const FrameRecord* after = history.find(frame.index + i);
    if (after == nullptr || after->stamp.capture - frame.stamp.capture > kTwistWithin) break;
    add(*after);
  }
  for (std::uint64_t i = 1; i <= frame.index; ++i) {
    const FrameRecord* before = history.find(frame.index - i);
    if (before == nullptr || frame.stamp.capture - before->stamp.capture > kTwistWithin) break;
    add(*before);
  }
  const double spread = n * sum_tt - sum_t * sum_t;
  if (!(spread > 0.0)) return {};
  return {(n * sum_tw - sum_t * sum_w) / spread, (n * sum_tp - sum_t * sum_p) / spread};
}

}  // namespace perimap
