// From the samples of one or two ECG leads to the heart's beats: R peaks, each with its class.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "core/phase/beat_classer.hpp"
#include "core/phase/lead_pair.hpp"
#include "core/phase/r_peak.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What the ECG thread makes of its samples, and whoever goes through a recording.
class BeatFinder {
 public:
  // As LeadPair's.
  [[nodiscard]] std::optional<RPeak> push(Instant t, float mV) noexcept { return classed(leads_.push(t, mV)); }
  [[nodiscard]] std::optional<RPeak> push(Instant t, float first_mV, float second_mV) noexcept {
    return classed(leads_.push(t, first_mV, second_mV));
  }
  void lead_off(Instant t) noexcept {
    leads_.lead_off(t);
    note_interruption();
  }
  [[nodiscard]] std::optional<RPeak> flush() noexcept { return classed(leads_.flush()); }
  // Of the lead that is heard better, of two.
  [[nodiscard]] EcgSignal signal() const noexcept { return leads_.signal(); }
  // Of that lead, 0 or 1.
  [[nodiscard]] EcgSignal signal(int lead) const noexcept { return leads_.signal(lead); }
  // A second lead has been heard.
  [[nodiscard]] bool two_leads() const noexcept { return leads_.two(); }

  // All is forgotten, as if it were new. The detectors' parts refer to each other, so they are made anew in place.
  void restart() noexcept {
    std::destroy_at(&leads_);
    std::construct_at(&leads_);
    classers_ = {};
    interruptions_ = 0;
    interrupted_ = false;
  }

  // Since the last call the signal has broken off: beats may be hidden after the one given last.
  [[nodiscard]] bool take_interruption() noexcept {
    const bool taken = interrupted_;
    interrupted_ = false;
    return taken;
  }

 private:
  // What was found before the signal broke off is classed before. Each lead has shapes of its own, so each has a
  // classer, and both hear of every beat; the class is that of the lead which gives the time.
  [[nodiscard]] std::optional<RPeak> classed(const std::optional<LeadBeat>& beat) noexcept {
    std::optional<RPeak> peak;
    const std::size_t heard = leads_.two() ? classers_.size() : 1;
    for (std::size_t lead = 0; beat && lead < heard; ++lead) {
      RPeak seen = beat->peak;
      seen.shape = beat->shapes[lead];
      seen = classers_[lead].classify(seen);
      if (static_cast<int>(lead) == beat->lead) peak = seen;
    }
    note_interruption();
    return peak;
  }
  void note_interruption() noexcept {
    if (leads_.interruptions() == interruptions_) return;
    interruptions_ = leads_.interruptions();
    interrupted_ = true;
    for (BeatClasser& classer : classers_) classer.interrupt();
  }

  LeadPair leads_;
  std::array<BeatClasser, 2> classers_;
  std::uint64_t interruptions_ = 0;
  bool interrupted_ = false;
};

}  // namespace perimap
