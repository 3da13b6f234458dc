#include "core/pipeline/scope_watch.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

// Where the turns are calibrated a scope that was turned far is found again soon; else it is only to be told.
constexpr Duration kReadEvery = std::chrono::milliseconds(250);
constexpr Duration kLookedEvery = std::chrono::seconds(1);
constexpr Duration kAdoptedAfter = std::chrono::milliseconds(200);
// Without a circle in the pictures: the frames' own readings, which go by the last one, are not believed longer.
constexpr Duration kFailuresBorne = std::chrono::seconds(2);

std::uint64_t microradians(double rotation_rad) noexcept {
  const double turn_rad = rotation_rad < 0.0 ? rotation_rad + kTwoPi : rotation_rad;
  return static_cast<std::uint64_t>(std::llround(1e6 * turn_rad));
}

}  // namespace

ScopeWatch::ScopeWatch(const PipelineSettings& settings, PipelineCounters& counters)
    : width_(settings.camera.width),
      height_(settings.camera.height),
      hand_over_(settings.lockstep),
      counters_(counters),
      pixels_(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_)) {
  if (!settings.turned_scope) return;
  if (settings.turned_scope->second_sensor) {
    sensed_.emplace(*settings.turned_scope, settings.camera, settings.pose);
  } else {
    turn_.emplace(*settings.turned_scope, settings.camera);
  }
}

void ScopeWatch::add_pose(const TrackerSample& sample) noexcept {
  if (sensed_) sensed_->add(sample);
}

void ScopeWatch::add_second_pose(const TrackerSample& sample) noexcept {
  if (sensed_) sensed_->add_second(sample);
}

ScopeWatch::Frame ScopeWatch::begin_frame(std::uint64_t frame_index, Instant capture, const GreyImage& image) noexcept {
  Frame frame;
  frame.mistaken_since = adopt(frame_index);
  if (turn_) {
    turn_->look(image);
    frame.state = turn_->state();
  } else if (sensed_) {
    frame.mistaken_from = sensed_->take_stuck_since();
    frame.state = sensed_->at(capture);
  } else {
    frame.changed = unchanged_.changed();
  }
  frame.unread = calibrated() && !frame.state;
  count(frame);
  return frame;
}

void ScopeWatch::count(const Frame& frame) noexcept {
  if (calibrated()) {
    counters_.scope_read.set(frame.state ? 1 : 0);
    if (frame.state) counters_.scope_rotation_urad.set(microradians(frame.state->rotation_rad));
    if (frame.unread) counters_.scope_frames_unread.add();
    counters_.scope_turns.set(turn_ ? turn_->turns() : sensed_->turns());
  } else {
    counters_.scope_read.set(unchanged_.is_read() ? 1 : 0);
    counters_.scope_rotation_urad.set(microradians(unchanged_.rotation_rad()));
    counters_.scope_changed.set(frame.changed ? 1 : 0);
    counters_.scope_turns.set(unchanged_.changes());
  }
}

void ScopeWatch::offer(std::uint64_t frame_index, const FrameRate& rate, const GreyImage& image) noexcept {
  if (sensed_ || hand_over_.under_way() || frame_index < next_at_) return;
  begun_at_ = frame_index;
  adopted_at_ = frame_index + rate.frames(kAdoptedAfter);
  next_at_ = std::max(frame_index + rate.frames(turn_ ? kReadEvery : kLookedEvery), adopted_at_ + 1);
  seen_then_ = turn_ ? turn_->seen() : std::nullopt;
  const auto row_bytes = static_cast<std::size_t>(width_);
  for (int y = 0; y < height_; ++y) {
    std::memcpy(pixels_.data() + static_cast<std::size_t>(y) * row_bytes, image.row(y), row_bytes);
  }
  hand_over_.begin();
}

std::optional<std::uint64_t> ScopeWatch::adopt(std::uint64_t frame_index) noexcept {
  if (!hand_over_.under_way() || frame_index < adopted_at_) return std::nullopt;
  const bool done = hand_over_.finish();
  const bool due = frame_index == adopted_at_;
  if (due && !done) counters_.adoptions_late.add();
  if (!done) return std::nullopt;
  // One that came late is lost, and makes room for the next.
  return due ? adopt_reading(reading_) : std::nullopt;
}

std::optional<std::uint64_t> ScopeWatch::adopt_reading(const std::optional<FieldStopReading>& reading) noexcept {
  failed_ = reading ? 0 : failed_ + 1;
  if (!turn_) {
    if (reading) unchanged_.read(*reading);
    if (!reading) unchanged_.fail();
    return std::nullopt;
  }
  if (!reading) {
    if (failed_ >= kFailuresBorne / kReadEvery) turn_->give_up();
    return std::nullopt;
  }
  const std::uint64_t agreed_before = agreed_at_;
  const bool mistaken = turn_->adopt(*reading, seen_then_);
  if (!mistaken) agreed_at_ = begun_at_;
  return mistaken ? std::optional(agreed_before + 1) : std::nullopt;
}

void ScopeWatch::serve() noexcept {
  hand_over_.serve([this] {
    const auto read = read_field_stop({pixels_.data(), width_, height_, width_});
    reading_ = read ? std::optional(*read) : std::nullopt;
  });
}

void ScopeWatch::dismiss() noexcept { hand_over_.dismiss(); }

}  // namespace perimap
