// What a worker does with one feature in each stage of a frame.
#pragma once

#include <array>
#include <cstdint>

#include "core/estimation/measurement_model.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_history.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/shard_snapshot.hpp"
#include "core/vision/image_pyramid.hpp"

namespace perimap {

// The basis at a frame's release time, with the phase as known now.
struct ReleaseBasis {
  std::uint64_t frame_sequence = 0;
  Basis b;
};

// One frame's common facts: written by the mapper before a stage, read by all workers during it.
struct FrameJob {
  const FrameRecord* frame = nullptr;
  const FrameHistory* history = nullptr;
  const ImagePyramid* pyramid = nullptr;
  std::array<ReleaseBasis, kReleasesCovered> releases;
  Instant learn_until;  // learning that has not begun by then is put off; never in lockstep
};

// A: predicts the feature's pixel with its covariance (map, phase and pose), searches there, leaves slot.match.
void predict_and_find(FeatureSlot& slot, const FrameJob& job, const PixelModel& model,
                      const PipelineSettings& settings) noexcept;

// C: the feature as of the release time. False for one that has no estimate yet: nothing is shown of it.
[[nodiscard]] bool evaluate(const FeatureSlot& slot, const FrameJob& job, FeatureSnapshot& snapshot) noexcept;

// D, first part, never put off: takes this frame's match into the queue of what is to be learnt.
void hold_match(FeatureSlot& slot, const FrameJob& job) noexcept;

enum class LearnOutcome : std::uint8_t {
  kNothing,
  kStartRequested,  // slot.start is filled: hand it to housekeeping
  kAdoptionLate,    // the batch start was due at this frame and is not there
  kStartedAnew,     // innovations stayed high: the observations of a new start are being gathered
  kLost             // the feature was given up; the slot is empty
};

// D, second part: applies held matches, at most kLearnPerFrame, and moves the feature through its life.
[[nodiscard]] LearnOutcome learn(FeatureSlot& slot, const FrameJob& job, const PixelModel& model,
                                 const PipelineSettings& settings) noexcept;

// Held matches applied per feature and frame: more than one, so that a queue drains.
inline constexpr int kLearnPerFrame = 3;

}  // namespace perimap
