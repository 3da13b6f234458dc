// What trackers and ECG devices gave, as messages of a recording, and back.
#pragma once

#include <perimap.h>

#include "core/error/expected.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/r_trigger_pulse.hpp"
#include "core/sensors/respiration_block.hpp"
#include "core/sensors/tracker_sample.hpp"

namespace perimap {

// A sample without a valid pose has NaN in the place of its rotation.
[[nodiscard]] perimap_TrackerPose to_tracker_pose(const TrackerSample& sample) noexcept;
// Borrows the samples: it must not outlive the block, and must not be freed.
[[nodiscard]] perimap_EcgSamples borrow_ecg_samples(const EcgBlock& block) noexcept;
// Of the second lead, where there is one.
[[nodiscard]] perimap_EcgSamples borrow_second_lead(const EcgBlock& block) noexcept;
[[nodiscard]] perimap_RTriggerPulse to_r_trigger_message(const RTriggerPulse& pulse) noexcept;
[[nodiscard]] perimap_RespirationSamples borrow_respiration_samples(const RespirationBlock& block) noexcept;

// Without the arrival, which the message itself does not hold. Fail when the rotation is none, or the block too long.
[[nodiscard]] Expected<TrackerSample> to_tracker_sample(const perimap_TrackerPose& message);
[[nodiscard]] Expected<EcgBlock> to_ecg_block(const perimap_EcgSamples& message);
// Puts a block of the second lead, read as one of the first, into that which was measured together with it; not when
// another was.
void join_second_lead(const EcgBlock& second, EcgBlock& first) noexcept;
[[nodiscard]] RTriggerPulse to_r_trigger_pulse(const perimap_RTriggerPulse& message) noexcept;
[[nodiscard]] Expected<RespirationBlock> to_respiration_block(const perimap_RespirationSamples& message);

}  // namespace perimap
