// How a feature passes from one state of its life to the next (docs/design/pipeline.md has the table).
#pragma once

#include <cstdint>

#include "core/estimation/measurement_model.hpp"
#include "core/pipeline/feature_slot.hpp"
#include "core/pipeline/frame_job.hpp"
#include "core/pipeline/map_bank.hpp"
#include "core/pipeline/pipeline_settings.hpp"

namespace perimap {

enum class LifeEvent : std::uint8_t {
  kNone,
  kStartRequested,  // slot.start is filled: hand it to housekeeping
  kAdoptionLate,    // the batch start was due at this frame and is not there
  kStartFailed,     // slot.start.outcome says why; it is tried again with newer observations
  kBegunOnSurface,  // mapped, by few matches and the surface through the others
  kOffSurface,      // its matches contradict the surface: it starts alone
  kStartedAnew,     // innovations stayed high: the observations of a new start are being gathered
  // The feature was given up; the slot is empty.
  kLostUnseen,    // not found for too long
  kLostRefused,   // found, but its estimate's gate refused match after match
  kLostUnstarted  // one more start failed, too many
};

// D, last part, after the frame's learning. `bank` holds the estimate of the slot as that of `feature`.
[[nodiscard]] LifeEvent advance(FeatureSlot& slot, MapBank& bank, int feature, const FrameJob& job,
                                const PixelModel& model, const PipelineSettings& settings) noexcept;

}  // namespace perimap
