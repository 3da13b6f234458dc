// Keeps the respiratory clock: searches for breathing in the images' common displacement, then follows its phase. A
// respiration channel, where there is one, tells the period and the phase beforehand.
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "core/phase/breath_detector.hpp"
#include "core/phase/respiration_memory.hpp"
#include "core/phase/respiration_search.hpp"
#include "core/phase/respiratory_clock.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct RespirationSettings {
  bool enabled = false;
  bool channel = false;  // a respiration channel is heard, where there is one
  RespirationSearchSettings search;
  double displacement_mm = 5.0;   // standard deviation per axis that is reckoned with while the phase is not known
  double suspected_rms_mm = 0.5;  // least displacement that is suspected to be breathing where it is off
};

// Once locked, the clock is a Kalman filter of phase and rate. Both may wander: a ventilator's rate hardly does, a
// patient's own breath by some percent. Until a whole breath has been learnt the map learns by this very clock, and
// what the images show by that map would only confirm it: they may contradict it, but do not correct it. When they have
// corrected it for half a breath they have told the rate, and with it what the phase was before. When they
// contradict it for kContradictedBeforeSearch, or tell nothing for kSilentBeforeSearch, the search begins again; the
// phase found then is counted as before, by the wave's shape.
//
// With a channel, the search has only to find the displacement that goes with its phase, in two breaths; each breath
// then corrects the clock as the images do. The channel's phase differs from the clock's by a constant that is known
// from the first lock on, so that a lock after a pause needs no shape. Where breathing stops in the channel, the clock
// is lost at once; where the channel is gone, the images carry on.
class RespiratoryTracker {
 public:
  explicit RespiratoryTracker(const RespirationSettings& settings) noexcept;

  // The common displacement of the surface, mm, frame W, from where the map has it: without breathing while the clock
  // is not locked, with it when it is. In order of time; the cardiac phase is that of the same instant.
  void add_displacement(Instant t, const Eigen::Vector3d& displacement_mm, double cardiac_phase_rad) noexcept;
  // The phase that a frame showed, for a locked clock. In order of time.
  void add_phase(Instant t, double phase_rad, double deviation_rad) noexcept;
  // A frame that showed no phase near the predicted one.
  void add_contradiction(Instant t) noexcept;

  // Before each frame: what the respiration channel told until then.
  void track_signal(const BreathSignal& signal, Instant now) noexcept;

  // After a lock: the map learns by this clock what it has seen already, and needs so long for it.
  void map_catches_up_for(Duration time) noexcept { first_breath_ = std::max(clock_.period(), time); }

  // Looks for breathing in what was added; takes some milliseconds.
  void search(Instant now) noexcept;

  // What another tracker goes on from.
  [[nodiscard]] RespirationMemory memory() const noexcept;
  // Before anything was added: goes on from what an earlier run knew, its phase carried on to `now` with the deviation
  // that it has got by then. Where that is too large, or the rate is none that is looked for, the phase is searched for
  // and counted as then; a suspicion stands, for as long as any.
  void recall(const RespirationMemory& memory, Instant now) noexcept;

  [[nodiscard]] const RespiratoryClock& clock() const noexcept { return clock_; }
  // Of the lock: the common displacement in the clock's phase.
  [[nodiscard]] const BreathWave& wave() const noexcept { return wave_; }
  [[nodiscard]] int locks() const noexcept { return locks_; }

 private:
  void predict(Instant t) noexcept;
  // Agrees with the clock, and then corrects it if it may, or contradicts it.
  void hear(Instant t, double phase_rad, double deviation_rad, bool corrects) noexcept;
  [[nodiscard]] bool rate_is_possible() const noexcept;
  void suspect(const FoundBreath& found, Instant now) noexcept;
  // The same period search after search, though much else moves the surface.
  [[nodiscard]] bool persists(const FoundBreath& found, Instant now) noexcept;
  void lose() noexcept;

  RespirationSettings settings_;
  RespirationSearch search_;
  RespiratoryClock clock_;
  BreathWave wave_;
  BreathSignal channel_;
  bool channel_known_ = false;
  bool offset_known_ = false;
  double offset_rad_ = 0.0;  // the clock's phase minus the channel's
  Instant last_agreed_;
  Instant last_told_;
  Duration first_breath_{};  // after a lock, until the map has learnt one
  Duration told_for_{};      // since the lock: in which images agreed with the clock
  int locks_ = 0;
  int in_a_row_ = 0;                  // searches that found what looks like breathing, while off
  double suspected_rad_per_s_ = 0.0;  // while off; 0: nothing is, or it was before
  int gone_in_a_row_ = 0;             // searches that found hardly anything of it
  double candidate_period_s_ = 0.0;   // of persists(); 0: none
  Instant candidate_since_;
};

}  // namespace perimap
