// From the samples of one ECG lead to its beats: R peaks, each with its class.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/phase/beat_classer.hpp"
#include "core/phase/r_peak.hpp"
#include "core/phase/r_peak_detector.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// What the ECG thread makes of its samples, and whoever goes through a recording.
class BeatFinder {
 public:
  // As RPeakDetector's.
  [[nodiscard]] std::optional<RPeak> push(Instant t, float mV) noexcept { return classed(detector_.push(t, mV)); }
  void lead_off(Instant t) noexcept {
    detector_.lead_off(t);
    note_interruption();
  }
  [[nodiscard]] std::optional<RPeak> flush() noexcept { return classed(detector_.flush()); }
  [[nodiscard]] EcgSignal signal() const noexcept { return detector_.signal(); }

  // All is forgotten, as if it were new. The detector's parts refer to each other, so it is made anew in its place.
  void restart() noexcept {
    std::destroy_at(&detector_);
    std::construct_at(&detector_);
    classer_ = BeatClasser();
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
  // What was found before the signal broke off is classed before.
  [[nodiscard]] std::optional<RPeak> classed(std::optional<RPeak> peak) noexcept {
    if (peak) *peak = classer_.classify(*peak);
    note_interruption();
    return peak;
  }
  void note_interruption() noexcept {
    if (detector_.interruptions() == interruptions_) return;
    interruptions_ = detector_.interruptions();
    interrupted_ = true;
    classer_.interrupt();
  }

  RPeakDetector detector_;
  BeatClasser classer_;
  std::uint64_t interruptions_ = 0;
  bool interrupted_ = false;
};

}  // namespace perimap
