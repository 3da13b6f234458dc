// What is believed of the heart's phase beyond what its ECG tells: a value that can be copied between threads.
#pragma once

#include <optional>
#include <type_traits>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/cycle_correction.hpp"
#include "core/phase/phase_law.hpp"

namespace perimap {

struct PhaseBelief {
  std::optional<LawBelief> law;  // what the images show of it; none: as the ECG's clock has it, as configured
  CycleCorrection cycle;         // what they show of the running cycle

  // The one way from the ECG's clock to the one that is believed. Mapper, publisher and status each take their own
  // newest clock of the ECG, as it stands at their own `now`.
  [[nodiscard]] CardiacClock clock(const CardiacClock& ecg, Instant now) const noexcept {
    return under_law(ecg, now).corrected(cycle);
  }
  // The same without what the images show of the running cycle.
  [[nodiscard]] CardiacClock under_law(const CardiacClock& ecg, Instant now) const noexcept {
    const CardiacClock heard = ecg.as_of(now);
    return law ? heard.with_law(*law) : heard;
  }
};

static_assert(std::is_trivially_copyable_v<PhaseBelief>);

}  // namespace perimap
