// Where sensor data enters the pipeline: the same for devices and for replay.
#pragma once

#include <atomic>
#include <cstdint>

#include "core/phase/breath_detector.hpp"
#include "core/pipeline/ecg_intake.hpp"
#include "core/pipeline/frame_pool.hpp"
#include "core/pipeline/frame_trace.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/realtime/spsc_ring.hpp"
#include "core/realtime/triple_buffer.hpp"
#include "core/realtime/wakeup.hpp"
#include "core/sensors/colour_image.hpp"
#include "core/sensors/device_count.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/sensors/grey_image.hpp"
#include "core/sensors/measured_frame_rate.hpp"
#include "core/sensors/r_trigger_pulse.hpp"
#include "core/sensors/respiration_block.hpp"
#include "core/sensors/tracker_sample.hpp"

namespace perimap {

// push_frame() belongs to the camera thread, push_pose() and push_tool_pose() to the tracker thread, push_ecg() to
// the ECG thread, push_r_trigger() to that of a trigger line, push_respiration() to that of a respiration channel; one
// thread may be all of them. None of them blocks or allocates. What does not fit is counted, never waited for.
class SensorEntrance {
 public:
  // `counters` and `trace`, null where none is kept, must outlive it.
  SensorEntrance(int width, int height, const EcgIntakeSettings& ecg, const BreathDetectorSettings& breath,
                 PipelineCounters& counters, FrameTrace* trace = nullptr);

  // Copies the pixels. `colour`, of this frame or the one before, may be left out; it is passed over unless it is
  // reduced as colour_image.hpp says. False when the mapper does not get the frame: no free buffer, or another size
  // than the pipeline's.
  bool push_frame(const FrameStamp& stamp, const GreyImage& image, const ColourImage& colour = {}) noexcept;
  void push_pose(const TrackerSample& sample) noexcept;
  void push_tool_pose(const ToolPose& pose) noexcept;
  void push_ecg(const EcgBlock& block) noexcept { ecg_.push(block); }
  void push_r_trigger(const RTriggerPulse& pulse) noexcept { ecg_.push(pulse); }

  void push_respiration(const RespirationBlock& block) noexcept;

  // Any thread: the next block of the ECG, and the next of the respiration channel, is of another patient.
  void ask_to_forget() noexcept {
    ecg_.ask_to_forget();
    forget_breath_asked_.store(true, std::memory_order_relaxed);
  }

  // Before the first block: one of an earlier run.
  void recall_ecg(const EcgBlock& block) noexcept { ecg_.recall(block); }
  // Whoever keeps the ECG for the next run.
  [[nodiscard]] bool pop_heard_ecg(EcgBlock& block) noexcept { return ecg_.pop_heard(block); }

  // Mapper side.
  [[nodiscard]] bool pop_frame(FrameHandle& frame) noexcept { return mapper_frames_.pop(frame); }
  [[nodiscard]] bool pop_pose(TrackerSample& sample) noexcept { return poses_.pop(sample); }
  [[nodiscard]] bool pop_tool_pose(ToolPose& pose) noexcept { return tool_poses_.pop(pose); }
  [[nodiscard]] GreyImage image(const FrameHandle& frame) noexcept { return pool_.image(frame.buffer); }
  // Without pixels when the frame came without colour.
  [[nodiscard]] ColourImage colour(const FrameHandle& frame) noexcept {
    return frame.coloured ? pool_.colour(frame.buffer) : ColourImage{};
  }
  void give_back(const FrameHandle& frame) noexcept { pool_.give_back(frame.buffer); }
  // The newest that the respiration channel told.
  [[nodiscard]] const BreathSignal& breath() noexcept {
    breath_cell_.update();
    return breath_cell_.front();
  }
  [[nodiscard]] Wakeup& mapper_wakeup() noexcept { return mapper_wakeup_; }

  // Publisher side: every frame's stamps as soon as it has arrived, however long the mapper takes.
  [[nodiscard]] bool pop_stamp(FrameStamp& stamp) noexcept { return publisher_stamps_.pop(stamp); }
  [[nodiscard]] Wakeup& publisher_wakeup() noexcept { return publisher_wakeup_; }

  [[nodiscard]] EcgClockCells& ecg_clocks() noexcept { return ecg_clocks_; }

 private:
  bool take_over(const FrameStamp& stamp, const GreyImage& image, const ColourImage& colour) noexcept;
  [[nodiscard]] bool store(const FrameStamp& stamp, const GreyImage& image, const ColourImage& colour) noexcept;
  void count(const RespirationBlock& block) noexcept;

  PipelineCounters& counters_;
  FrameTrace* trace_;
  FramePool pool_;
  SpscRing<FrameHandle> mapper_frames_;
  SpscRing<FrameStamp> publisher_stamps_;
  SpscRing<TrackerSample> poses_;
  SpscRing<ToolPose> tool_poses_;
  Wakeup mapper_wakeup_;
  Wakeup publisher_wakeup_;
  EcgClockCells ecg_clocks_;
  EcgIntake ecg_;
  BreathDetectorSettings breath_settings_;
  BreathDetector breath_;
  std::atomic<bool> forget_breath_asked_{false};  // relaxed: a message by itself
  TripleBuffer<BreathSignal> breath_cell_;
  MeasuredFrameRate frame_rate_;
  bool any_frame_ = false;
  std::uint64_t last_sequence_ = 0;
  bool any_pose_ = false;
  Instant last_pose_time_;
  DeviceCount respiration_count_;
};

}  // namespace perimap
