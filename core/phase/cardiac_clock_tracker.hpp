// Keeps the cardiac clock: takes R peaks as they are detected and re-anchors at each peak's own time.
#pragma once

#include <chrono>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/ectopic_rhythm.hpp"
#include "core/phase/phase_law.hpp"
#include "core/phase/r_peak.hpp"
#include "core/phase/rhythm_monitor.hpp"
#include "core/phase/rr_predictor.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct CardiacClockSettings {
  PhaseLawSettings law;
  RrMethod predictor = RrMethod::kAutoregressive;
  AutoregressionSettings autoregression;
  // A beat is missed only when it could have been known: due time + 3 deviations + this.
  Duration detector_delay = std::chrono::milliseconds(150);
  // After the due beat. Four missed beats at rest; by then the free-running deviation is a good part of a cycle.
  Duration lost_after = std::chrono::seconds(3);
};

class CardiacClockTracker {
 public:
  explicit CardiacClockTracker(const CardiacClockSettings& settings) noexcept;

  // In order of time. A peak less than 250 ms after the last (or before it) is refused, and so is one classed as noise.
  //
  // What teaches: a cycle from a normal beat to a normal beat, with the lead on all the while. Where there are hardly
  // any (ectopic beats prevail), the rhythm is called so, and then the cycles that begin with a normal beat teach the
  // map, though not the rhythm, however they end: until the premature beat the heart moves as after any normal one.
  void on_r_peak(const RPeak& peak) noexcept;

  // The signal has been looked through up to here.
  void heard(Instant until) noexcept;
  // From here on it means nothing (lead off, a flat line, samples missing) until it is heard again.
  void interrupt() noexcept;

  [[nodiscard]] const CardiacClock& clock() const noexcept { return clock_; }

 private:
  void predict() noexcept;
  [[nodiscard]] double premature_share() const noexcept;

  RrPredictor predictor_;
  RhythmMonitor rhythm_;
  CardiacClock clock_;
  EctopicRhythm ectopic_;
  bool last_unusual_ = false;  // the last beat's shape
  bool unheard_ = false;       // since the last beat the signal was interrupted
};

}  // namespace perimap
