// What a worker does with one feature in the stages A and C and at the beginning of D.
#pragma once

#include "core/estimation/measurement_model.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_job.hpp"
#include "core/pipeline/pipeline_settings.hpp"
#include "core/pipeline/pixel_prediction.hpp"
#include "core/pipeline/shard_snapshot.hpp"

namespace perimap {

// A: predicts the feature's pixel with its covariance (map and pose, or its own motion in the image), searches there,
// leaves slot.match. Where the shift that the predictions have in common is known, a mapped feature is searched for
// near there first.
void predict_and_find(FeatureSlot& slot, const MapPrediction& from_map, const FrameJob& job, const PixelModel& model,
                      const PipelineSettings& settings) noexcept;

// The patch follows something else: the next search begins where the map says.
void let_go(FeatureSlot& slot, const FrameRecord& frame) noexcept;

// B: a match that the frame's other matches contradict is none.
void refuse_match(FeatureSlot& slot, const FrameRecord& frame) noexcept;

// After the hand-over: what was not found, or went another way than what is around it, is searched for again where the
// pose that the frame's matches agree on has it, or where its neighbours have moved. Then what was found is believed.
void settle_match(FeatureSlot& slot, const MapPrediction& from_map, const FrameJob& job, const PixelModel& model,
                  const PipelineSettings& settings) noexcept;

// So long a feature is still called converged after it was last observed. One that is looked for is mostly given up
// before, see kUnobservedFramesBeforeLost; one that is shed is not.
inline constexpr Duration kBelievedUnseen = std::chrono::seconds(30);
// What surfaces and the status say of a mapped feature. `now`: the capture, with its doubts.
[[nodiscard]] bool is_called_converged(const FeatureSlot& slot, Instant now, const FrameDoubts& doubts) noexcept;

// C: all of a mapped feature's snapshot but its coefficients and covariances, which the bank has. `now`: the capture.
void describe(const FeatureSlot& slot, Instant now, const FrameDoubts& doubts, FeatureSnapshot& snapshot) noexcept;

// What the bank's covariance of its estimate leaves out: errors of its matches that come again, and slow ones of the
// tracker.
void add_lasting_errors(const FeatureSlot& slot, StateMatrix& P) noexcept;

// D, first part, never put off: takes this frame's match into the queue of what is to be learnt.
void hold_match(FeatureSlot& slot, const FrameJob& job) noexcept;

}  // namespace perimap
