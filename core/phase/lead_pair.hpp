// The beats of one heart, of which one or two leads are heard.
//
// Each lead has a detector of its own; what they tell is agreed upon beat by beat (lead_agreement). Of one lead alone
// beats are told as its detector tells them, and as soon.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/phase/ecg_signal.hpp"
#include "core/phase/lead_agreement.hpp"
#include "core/phase/r_peak_detector.hpp"
#include "core/time/instant.hpp"

namespace perimap {

class LeadPair {
 public:
  // The next sample of a heart of which one lead is heard. As RPeakDetector's, and as soon.
  [[nodiscard]] std::optional<LeadBeat> push(Instant t, float mV) noexcept;
  // Of both; a value that is not finite is missing. Beats come in order of time.
  [[nodiscard]] std::optional<LeadBeat> push(Instant t, float first_mV, float second_mV) noexcept;
  // All electrodes fell off.
  void lead_off(Instant t) noexcept;
  // As RPeakDetector's.
  [[nodiscard]] std::optional<LeadBeat> flush() noexcept;

  // A second lead has been heard.
  [[nodiscard]] bool two() const noexcept { return two_; }
  // Of the lead that is heard better.
  [[nodiscard]] EcgSignal signal() const noexcept;
  // Of that lead, 0 or 1.
  [[nodiscard]] EcgSignal signal(int lead) const noexcept {
    return detectors_[static_cast<std::size_t>(lead)].signal();
  }
  // How often nothing was heard any more in any lead.
  [[nodiscard]] std::uint64_t interruptions() const noexcept { return interruptions_; }

 private:
  void hear(Instant t) noexcept;
  [[nodiscard]] std::optional<LeadBeat> decide(bool ending) noexcept;

  std::array<RPeakDetector, 2> detectors_;
  LeadAgreement agreement_;
  bool two_ = false;
  std::array<std::uint64_t, 2> interrupted_{};
  std::uint64_t interruptions_ = 0;
};

}  // namespace perimap
