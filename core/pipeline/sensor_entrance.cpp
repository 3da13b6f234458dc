#include "core/pipeline/sensor_entrance.hpp"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstring>

#include "core/pipeline/hear_breath.hpp"
#include "core/realtime/realtime_scope.hpp"

namespace perimap {
namespace {

// A mapper that is held up for so long loses no frame. Held up longer, it is to go on with what is new: frames that
// wait make all updates late.
constexpr Duration kFramesWait = std::chrono::milliseconds(267);
// As many frames as that is at the fastest rate that the frame history keeps pace with, and the last one that was
// mapped; of pictures that are too large, as many as have room.
constexpr double kFastest_per_s = 280.0;
constexpr std::size_t kFrameMemory = std::size_t{64} << 20;  // bytes
int frames_that_wait(const FrameRate& rate) noexcept { return static_cast<int>(rate.frames(kFramesWait)) + 1; }
int frame_buffers(int width, int height) noexcept {
  const auto room = static_cast<int>(kFrameMemory / std::max<std::size_t>(FramePool::bytes(width, height), 1));
  return std::clamp(room, frames_that_wait(FrameRate()), frames_that_wait(FrameRate(kFastest_per_s)));
}
// More than a minute at 60 frames/s: what a publisher that was held up has to know.
constexpr std::size_t kStampRing = 4096;
constexpr std::size_t kPoseRing = 256;  // more than a second of a fast tracker

}  // namespace

SensorEntrance::SensorEntrance(int width, int height, const EcgIntakeSettings& ecg,
                               const BreathDetectorSettings& breath, PipelineCounters& counters, FrameTrace* trace)
    : counters_(counters),
      trace_(trace),
      pool_(width, height, frame_buffers(width, height)),
      mapper_frames_(static_cast<std::size_t>(frame_buffers(width, height))),
      publisher_stamps_(kStampRing),
      poses_(kPoseRing),
      tool_poses_(kToolRoles * kPoseRing),
      ecg_(ecg, ecg_clocks_, counters),
      breath_settings_(breath),
      breath_(breath) {}

bool SensorEntrance::push_frame(const FrameStamp& stamp, const GreyImage& image, const ColourImage& colour) noexcept {
  const RealtimeScope realtime;
  if (trace_ == nullptr) return take_over(stamp, image, colour);
  const Instant begin = MonotonicClock::now();
  const bool taken = take_over(stamp, image, colour);
  trace_->arrivals.add({stamp, begin, MonotonicClock::now()});
  return taken;
}

bool SensorEntrance::take_over(const FrameStamp& stamp, const GreyImage& image, const ColourImage& colour) noexcept {
  counters_.frames_received.add();
  // A capture after its own arrival is a broken stamp; on it the release times of all that follows would be fitted.
  if (stamp.capture > stamp.arrival) {
    counters_.frames_dropped.add();
    return false;
  }
  counters_.camera_delay.add(stamp.arrival - stamp.capture);
  counters_.last_frame_ns.set(static_cast<std::uint64_t>(to_ns(stamp.capture)));
  if (any_frame_ && stamp.sequence > last_sequence_ + 1) {
    counters_.frames_dropped.add(stamp.sequence - last_sequence_ - 1);
  }
  any_frame_ = true;
  last_sequence_ = stamp.sequence;
  frame_rate_.add(stamp.capture);
  // The release is owed even when the pixels find no place, so the stamps go first.
  const bool told = publisher_stamps_.push(stamp);
  if (told) publisher_wakeup_.post();
  const bool stored = store(stamp, image, colour);
  // One whose stamps find no place is mapped, but released as if it had not come.
  if (!told || !stored) counters_.frames_dropped.add();
  return stored;
}

bool SensorEntrance::store(const FrameStamp& stamp, const GreyImage& image, const ColourImage& colour) noexcept {
  const bool fits = image.width == pool_.width() && image.height == pool_.height();
  const int buffer = fits ? pool_.acquire(frames_that_wait(frame_rate_.rate())) : -1;
  if (buffer < 0) return false;
  const auto width = static_cast<std::size_t>(image.width);
  for (int y = 0; y < image.height; ++y) {
    std::memcpy(pool_.pixels(buffer) + static_cast<std::size_t>(y) * width, image.row(y), width);
  }
  const ColourImage room = pool_.colour(buffer);
  const bool coloured = colour.bgr != nullptr && colour.width == room.width && colour.height == room.height;
  for (int y = 0; coloured && y < room.height; ++y) {
    std::memcpy(pool_.bgr(buffer) + y * room.stride, colour.row(y), static_cast<std::size_t>(room.stride));
  }
  if (!mapper_frames_.push({buffer, coloured, stamp})) {
    pool_.give_back(buffer);
    return false;
  }
  mapper_wakeup_.post();
  return true;
}

void SensorEntrance::push_pose(const TrackerSample& sample) noexcept {
  const RealtimeScope realtime;
  counters_.poses_received.add();
  counters_.tracker_delay.add(sample.arrival - sample.source_time);
  if (any_pose_) counters_.tracker_interval.add(sample.source_time - last_pose_time_);
  any_pose_ = true;
  last_pose_time_ = sample.source_time;
  counters_.last_pose_ns.set(static_cast<std::uint64_t>(to_ns(sample.source_time)));
  if (sample.state == ToolState::kOk) {
    counters_.last_good_pose_ns.set(static_cast<std::uint64_t>(to_ns(sample.source_time)));
  } else {
    counters_.poses_invalid.add();
  }
  if (!poses_.push(sample)) {
    counters_.poses_dropped.add();
    return;
  }
  mapper_wakeup_.post();
}

void SensorEntrance::push_tool_pose(const ToolPose& pose) noexcept {
  const RealtimeScope realtime;
  if (!tool_poses_.push(pose)) {
    counters_.poses_dropped.add();
    return;
  }
  mapper_wakeup_.post();
}

void SensorEntrance::count(const RespirationBlock& block) noexcept {
  const std::uint64_t lost = respiration_count_.lost_before(block.device_sequence, block.count);
  if (lost > 0) counters_.respiration_dropped.add(lost);
  counters_.respiration_samples.add(block.count);
  if (block.sensor_off) counters_.respiration_off.add(block.count);
  if (block.count == 0) return;
  const Instant last = block.last_sample_time();
  counters_.respiration_delay.add(block.arrival - last);
  counters_.last_respiration_ns.set(static_cast<std::uint64_t>(to_ns(last)));
  if (!block.sensor_off) counters_.last_good_respiration_ns.set(static_cast<std::uint64_t>(to_ns(last)));
}

void SensorEntrance::push_respiration(const RespirationBlock& block) noexcept {
  const RealtimeScope realtime;
  if (forget_breath_asked_.exchange(false, std::memory_order_relaxed)) breath_ = BreathDetector(breath_settings_);
  count(block);
  hear_breath(block, breath_);
  breath_cell_.write(breath_.signal());
}

}  // namespace perimap
