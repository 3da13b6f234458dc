// Finds R peaks in one ECG lead, causally, sample by sample.
//
// Four parts, each testable alone: the line (ecg_line: rate, gaps, flat), the levels of the signal (ecg_levels), what
// may be a QRS complex (candidate_finder and qrs_candidate), and which of them are beats (beat_decision).
//
// Every level is relative to this signal, so gain does not matter; slope counts by magnitude and the peak by the
// polarity that prevails, so the lead's polarity does not matter. The time given is that of the local peak itself: the
// vertex of a parabola through the samples within 10 ms of it.
#pragma once

#include <cstdint>
#include <optional>

#include "core/phase/beat_decision.hpp"
#include "core/phase/candidate_finder.hpp"
#include "core/phase/ecg_filter.hpp"
#include "core/phase/ecg_levels.hpp"
#include "core/phase/ecg_line.hpp"
#include "core/phase/ecg_signal.hpp"
#include "core/phase/r_peak.hpp"
#include "core/phase/r_peak_detector_settings.hpp"
#include "core/time/instant.hpp"

namespace perimap {

class RPeakDetector {
 public:
  // Rates from 100 to 1000 Hz are supported; at others no peak is found. The rate is learnt from the stamps; when it
  // turns out to be another, all is learnt anew.
  explicit RPeakDetector(const RPeakDetectorSettings& settings = {}) noexcept;
  RPeakDetector(const RPeakDetector&) = delete;  // its parts refer to each other
  RPeakDetector& operator=(const RPeakDetector&) = delete;
  ~RPeakDetector() = default;

  // The next sample, evenly stamped. A stamp that does not advance is ignored; a value that is not finite is a missing
  // sample. At most one peak a call; when several become known at once, the next calls give the others.
  [[nodiscard]] std::optional<RPeak> push(Instant t, float mV) noexcept;

  // The electrode fell off: forgets the signal, and after 30 s its levels too.
  void lead_off(Instant t) noexcept;

  // The signal has ended: what is still in decision. Call until it gives none.
  [[nodiscard]] std::optional<RPeak> flush() noexcept;

  [[nodiscard]] EcgSignal signal() const noexcept;
  // What it has seen so near to `t` and not told yet.
  [[nodiscard]] Pondered ponders(Instant t, Duration near) const noexcept { return decision_.ponders(t, near); }
  // How often the signal has broken off; in each of them beats may be hidden, and those of the 0.1 s before.
  [[nodiscard]] std::uint64_t interruptions() const noexcept { return line_.interruptions(); }

 private:
  // What the line gives.
  struct Sink {
    RPeakDetector& detector;
    void sample(Instant t, double mV, bool made_up) noexcept { detector.take_sample(t, mV, made_up); }
    void break_off() noexcept { detector.restart(); }
    void forget() noexcept { detector.forget(); }
    void rate(Duration period) noexcept { detector.set_period(period); }
  };

  void take_sample(Instant t, double mV, bool made_up) noexcept;
  void restart() noexcept;
  void forget() noexcept;
  void set_period(Duration period) noexcept;

  RPeakDetectorSettings settings_;
  EcgLine line_;
  EcgFilter filter_;
  EcgLevels levels_;
  CandidateFinder finder_;
  BeatDecision decision_;
  Instant newest_;
  bool ending_ = false;
  bool learning_ = true;
};

}  // namespace perimap
