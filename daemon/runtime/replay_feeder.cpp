#include "daemon/runtime/replay_feeder.hpp"

#include <spdlog/spdlog.h>

#include <utility>
#include <variant>

#include "core/realtime/deadline.hpp"

namespace perimap {
namespace {

constexpr std::size_t kReadAhead = 256;  // events; about 1.5 s, 40 MB of 640x480 frames
constexpr Duration kLead = std::chrono::milliseconds(500);
// A sleep ends at least this often to look whether it should stop.
constexpr Duration kLongestSleep = std::chrono::milliseconds(100);

}  // namespace

ReplayFeeder::ReplayFeeder(ReplayReader reader, const SensorIntake& intake, std::optional<Duration> offset,
                           ReplayEdit edit)
    : reader_(std::move(reader)), intake_(intake), offset_(offset), edit_(std::move(edit)) {
  if (intake_.recorder != nullptr) reader_.keep_frames_as_they_came();
}

void ReplayFeeder::start(ThreadLauncher& threads) {
  reading_ = threads.launch("replay-read", ThreadRole::kHousekeeping, [this] { read_ahead(); });
  delivering_ = threads.launch("replay-feed", ThreadRole::kSource, [this] { deliver(); });
}

void ReplayFeeder::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (reading_.joinable()) reading_.join();
  if (delivering_.joinable()) delivering_.join();
}

void ReplayFeeder::read_ahead() {
  for (;;) {
    auto event = reader_.next();
    const bool read = event && *event;
    const ReplayStep step = read && edit_ ? edit_(**event) : ReplayStep::kDeliver;
    if (step == ReplayStep::kSkip) continue;
    std::unique_lock lock(mutex_);
    if (!read || step == ReplayStep::kEnd) {
      if (!event) error_ = std::move(event.error());
      read_all_ = true;
      changed_.notify_all();
      return;
    }
    changed_.wait(lock, [this] { return stopping_ || ahead_.size() < kReadAhead; });
    if (stopping_) return;
    ahead_.push_back(std::move(**event));
    changed_.notify_all();
  }
}

std::optional<ReplayEvent> ReplayFeeder::next_event() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return stopping_ || read_all_ || !ahead_.empty(); });
  if (stopping_ || ahead_.empty()) return std::nullopt;
  ReplayEvent event = std::move(ahead_.front());
  ahead_.pop_front();
  changed_.notify_all();
  return event;
}

void ReplayFeeder::deliver() {
  std::optional<Duration> offset = offset_;
  const Instant begun = MonotonicClock::now();
  std::vector<std::uint8_t> passed_over;  // the last colour
  std::optional<Instant> before;          // as recorded
  while (auto event = next_event()) {
    const Instant recorded = arrival_of(*event);
    if (!offset) offset = MonotonicClock::now() + kLead - recorded;
    // What is played beside other devices keeps its time.
    if (before && !offset_ && recorded - *before > kLongestReplayedGap) {
      const Duration gap = recorded - *before;
      spdlog::warn("the recording has a gap of {:.0f} s, of which {:.0f} s are played", to_seconds(gap),
                   to_seconds(kLongestReplayedGap));
      *offset -= gap - kLongestReplayedGap;
    }
    before = recorded;
    shift(*event, *offset);
    const Instant arrival = arrival_of(*event);
    // As from a device: what came before there was anyone to take it is gone; but that there is colour is known from
    // the first frame on.
    if (offset_ && arrival < begun) {
      if (auto* frame = std::get_if<FrameEvent>(&*event); frame != nullptr && !frame->bgr.empty()) {
        passed_over.swap(frame->bgr);
      }
      continue;
    }
    if (auto* frame = std::get_if<FrameEvent>(&*event); frame != nullptr && !passed_over.empty()) {
      if (frame->bgr.empty()) frame->bgr.swap(passed_over);
      passed_over.clear();
    }
    for (Instant now = MonotonicClock::now(); now < arrival; now = MonotonicClock::now()) {
      sleep_until(std::min(arrival, now + kLongestSleep));
      const std::lock_guard lock(mutex_);
      if (stopping_) return;
    }
    if (const auto* frame = std::get_if<FrameEvent>(&*event)) {
      intake_.frame(frame->as_it_came(), frame->image(), frame->colour());
    } else if (const auto* other = std::get_if<ToolSample>(&*event)) {
      intake_.other_tool(*other);
    } else if (const auto* pose = std::get_if<TrackerSample>(&*event)) {
      intake_.pose(*pose);
    } else if (const auto* tool = std::get_if<ToolPose>(&*event)) {
      intake_.tool_pose(*tool);
    } else if (const auto* ecg = std::get_if<EcgBlock>(&*event)) {
      intake_.ecg(*ecg);
    } else if (const auto* respiration = std::get_if<RespirationBlock>(&*event)) {
      intake_.respiration(*respiration);
    } else {
      intake_.r_trigger(std::get<RTriggerPulse>(*event));
    }
  }
  ended_.store(true, std::memory_order_release);
}

}  // namespace perimap
