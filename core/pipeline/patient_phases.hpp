// The phases of the patient's two motions, the heart's and breathing's: what is believed of them at a frame, what its
// matches tell of them, and what other threads are told.
#pragma once

#include <span>

#include "core/estimation/measurement_model.hpp"
#include "core/estimation/shared_pose.hpp"
#include "core/phase/breath_detector.hpp"
#include "core/phase/cardiac_clock.hpp"
#include "core/phase/heart_phase.hpp"
#include "core/pipeline/breathing.hpp"
#include "core/pipeline/feature_group.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/image_phase.hpp"
#include "core/pipeline/map_memory.hpp"
#include "core/pipeline/phase_cells.hpp"
#include "core/pipeline/pipeline_counters.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/sensors/frame_stamp.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// All members are called by the mapper thread; nothing is allocated after construction.
class PatientPhases {
 public:
  // By what a frame's beginning changes how earlier frames are told.
  struct Change {
    HeartPhase::Change heart;
    Breathing::Change breath;
  };

  // All must outlive it.
  PatientPhases(const PipelineSettings& settings, PhaseCells& cells, PipelineCounters& counters);

  // Before begin_frame(): what the respiration channel told until that capture, or later.
  void hear(const BreathSignal& signal, Instant capture) noexcept { breathing_.hear(signal, capture); }
  // Before a frame is appended to the history. `ecg`: the ECG's newest clock.
  [[nodiscard]] Change begin_frame(const CardiacClock& ecg, const FrameStamp& stamp,
                                   const FrameHistory& history) noexcept;
  // Of the frame, whose pose is set: its phases, and how the surface is displaced as long as breathing is not known.
  void tell(FrameRecord& frame, FrameHistory& history) noexcept;
  // What features start from has told of the heart's law.
  void add(const LawTrial& trial) noexcept { heart_.add(trial); }

  // B: takes what the matches tell, and publishes what is believed then. It changes the time to come: the publisher
  // evaluates with it, and so does the next frame's A. Returns the pose that the matches agree on; null where they do
  // not tell it, or were not asked.
  [[nodiscard]] const CommonEstimate* settle(std::span<FeatureGroup> groups, const FrameRecord& frame) noexcept;
  void publish() noexcept;

  // What asks a frame's matches for what they have in common.
  [[nodiscard]] ImagePhase& image() noexcept { return image_; }

  // Another patient.
  void forget() noexcept;
  // Before the first frame: what an earlier run knew, carried on to `now`.
  void recall(const MapMemory& memory, Instant now) noexcept;

  [[nodiscard]] const HeartPhase& heart() const noexcept { return heart_; }
  [[nodiscard]] const Breathing& breathing() const noexcept { return breathing_; }
  // D, once a frame, beside the workers.
  void search_breath(const FrameRecord& frame) noexcept { breathing_.search(frame); }

 private:
  const PipelineSettings& settings_;
  PixelModel model_;
  PhaseCells& cells_;
  PipelineCounters& counters_;

  HeartPhase heart_;
  Breathing breathing_;
  ImagePhase image_;
};

}  // namespace perimap
