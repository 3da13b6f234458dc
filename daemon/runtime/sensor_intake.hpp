// Where the sources' threads put what they have got: the pipeline, a recording, and whoever else looks at the frames.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "core/pipeline/sensor_entrance.hpp"
#include "daemon/runtime/session_recorder.hpp"
#include "daemon/runtime/tool_teller.hpp"
#include "drivers/image/camera_frame.hpp"

namespace perimap {

// Sees each frame as it came, on the thread that brings it.
class FrameObserver {
 public:
  FrameObserver() = default;
  FrameObserver(const FrameObserver&) = delete;
  FrameObserver& operator=(const FrameObserver&) = delete;
  virtual ~FrameObserver() = default;
  virtual void frame(const CameraFrame& frame) = 0;
};

// Each may be null. Each call belongs to one thread.
struct SensorIntake {
  SensorEntrance* entrance = nullptr;
  SessionRecorder* recorder = nullptr;
  FrameObserver* observer = nullptr;
  std::array<std::optional<std::size_t>, kToolRoles> roles{};  // by ToolRole: which ToolSample::tool has it
  ToolTeller* tools = nullptr;

  // To the pipeline first: it is the one in a hurry.
  void frame(const CameraFrame& as_it_came, const GreyImage& grey, const ColourImage& colour) const noexcept {
    if (entrance != nullptr) static_cast<void>(entrance->push_frame(as_it_came.stamp, grey, colour));
    if (recorder != nullptr) recorder->frame(as_it_came);
    if (observer != nullptr) observer->frame(as_it_came);
  }
  void pose(const TrackerSample& sample) const noexcept {
    if (entrance != nullptr) entrance->push_pose(sample);
    if (recorder != nullptr) recorder->pose(sample);
  }
  // The pipeline takes those that have a role.
  void tool(const ToolSample& sample) const noexcept {
    for (std::size_t role = 0; role < roles.size(); ++role) {
      if (sample.tool == roles[role]) tool_pose({static_cast<ToolRole>(role), sample});
    }
    other_tool(sample);
    if (recorder != nullptr) recorder->tool(sample);
  }
  // Of a recording; not recorded again.
  void other_tool(const ToolSample& sample) const noexcept {
    if (tools != nullptr) tools->push(sample);
  }
  // Of a recording; not recorded again.
  void tool_pose(const ToolPose& pose) const noexcept {
    if (entrance != nullptr) entrance->push_tool_pose(pose);
  }
  void ecg(const EcgBlock& block) const noexcept {
    if (entrance != nullptr) entrance->push_ecg(block);
    if (recorder != nullptr) recorder->ecg(block);
  }
  void respiration(const RespirationBlock& block) const noexcept {
    if (entrance != nullptr) entrance->push_respiration(block);
    if (recorder != nullptr) recorder->respiration(block);
  }
  void r_trigger(const RTriggerPulse& pulse) const noexcept {
    if (entrance != nullptr) entrance->push_r_trigger(pulse);
    if (recorder != nullptr) recorder->r_trigger(pulse);
  }
};

}  // namespace perimap
