// The phase of the heart at any instant: a snapshot that can be copied between threads.
//
// Between two known R peaks the phase is exact. After the last one it runs on the predicted length of the current
// cycle, and past that on the predicted lengths of the cycles to come, with a deviation that grows: by what the
// prediction misses of a normal beat, and where no beat can be heard also by what a premature one would shift.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <type_traits>

#include "core/phase/cycle_correction.hpp"
#include "core/phase/phase_law.hpp"
#include "core/phase/r_peak.hpp"
#include "core/phase/rhythm_monitor.hpp"
#include "core/phase/seconds.hpp"
#include "core/time/instant.hpp"

namespace perimap {

enum class PhaseState : std::uint8_t {
  kUnknown,      // fewer than three beats in a row yet, or before the history held: the phase means nothing
  kLocked,       // between known beats, or within the cycle that follows one
  kFreeRunning,  // a beat was due and has not come, or the ECG is gone; the phase goes on from predicted lengths
  kFromImage,    // the same, but the images tell the phase
  kLost          // no beat for so long that the phase means nothing
};

// Whether there is a phase to predict with.
[[nodiscard]] constexpr bool usable(PhaseState state) noexcept {
  return state == PhaseState::kLocked || state == PhaseState::kFreeRunning || state == PhaseState::kFromImage;
}

struct PhaseEstimate {
  double phase_rad = 0.0;       // [0, 2 pi), 0 = R peak
  double rate_rad_per_s = 0.0;  // 0 when the phase means nothing
  double deviation_s = 0.0;     // standard deviation of the phase, as time: phase deviation = rate * this
  PhaseState state = PhaseState::kUnknown;
  bool exact = false;          // the cycle is completed: both its R peaks are known
  bool contradicted = false;   // the images show another phase
  bool teaches = false;        // exact, and what was seen in the cycle may be learnt
  bool law_undecided = false;  // laws that are not ruled out differ in the running cycle by what shows on a surface
  bool ectopic = false;        // the running cycle began with a premature beat: the heart may move otherwise than usual
};

// One cycle, completed or predicted.
struct CardiacCycle {
  Instant begin;  // R peak, or its prediction; up to 3 % of the length beside it where it gave way, see CyclePosterior
  Duration begin_deviation{0};
  Duration length{0};
  Duration length_deviation{0};
  Duration previous_length{0};  // the warped law depends on it
  Duration previous_length_deviation{0};
  Duration systole{0};       // under the warped law's rule
  Duration irregularity{0};  // completed: by how much its end missed the prediction, 0 when in rhythm
  bool completed = false;    // both its R peaks are known
  bool teaches = false;      // completed, and what was seen in it may be learnt, see CardiacClockTracker
};

// An R peak whose time is better known than by the ECG alone.
struct MovedRPeak {
  std::uint64_t beat = 0;  // CardiacClock::beats() from that R peak to the next
  Duration by{0};          // later than the ECG has it
  Duration deviation{0};
};

class CardiacClock {
 public:
  static constexpr int kCompletedCycles = 32;
  static constexpr int kPredictedCycles = 4;  // further ones repeat the last
  static constexpr int kBeatsToLock = 3;
  static constexpr Duration kSilence = std::chrono::milliseconds(250);  // longer than any device takes to deliver

  [[nodiscard]] CardiacClock with_law(const LawBelief& law) const noexcept;
  // The same as it stands at `now`: an ECG of which nothing has been heard for kSilence is gone.
  [[nodiscard]] CardiacClock as_of(Instant now) const noexcept;
  // The same with the running cycle as corrected; unchanged when the correction is of another cycle, or carries the
  // phase on although as_of() its instant the ECG tells it.
  [[nodiscard]] CardiacClock corrected(const CycleCorrection& correction) const noexcept;
  // The same with these R peaks so much later, each by less than a cycle; those that it does not hold are passed over.
  // As the ECG tells it: a clock that the images carry on stays as it is.
  [[nodiscard]] CardiacClock with_r_peaks(std::span<const MovedRPeak> moved) const noexcept;

  // Any instant. Instants before the history, and those in gaps too long to be cycles, are kUnknown or kLost with rate
  // 0.
  [[nodiscard]] PhaseEstimate at(Instant t) const noexcept;

  // The last R peak, wherever the running cycle begins, and the cycle predicted to follow it. Zero before the first
  // beat.
  [[nodiscard]] Instant anchor() const noexcept;
  [[nodiscard]] Duration anchor_deviation() const noexcept;
  [[nodiscard]] Duration predicted_length(int ahead = 0) const noexcept;  // of the running cycle or a later one
  [[nodiscard]] Duration length_deviation() const noexcept;
  [[nodiscard]] Duration last_rr() const noexcept;  // zero before the second beat of a run
  [[nodiscard]] Instant predicted_r_peak() const noexcept { return beat(0).time + predicted_length(); }
  [[nodiscard]] Duration predicted_r_peak_deviation() const noexcept;
  // A later instant counts as free-running: the beat that is due should be known by then. With the ECG gone that holds
  // for earlier ones as well.
  [[nodiscard]] Instant expected_until() const noexcept;
  // From here on the phase is lost unless a beat comes.
  [[nodiscard]] Instant lost_from() const noexcept { return predicted_r_peak() + lost_after_; }
  // An R peak is usually known so long after it.
  [[nodiscard]] Duration detector_delay() const noexcept { return detector_delay_; }

  // The cycle that holds t; while free-running it begins at a predicted R peak. Lengths are zero when the phase at t
  // means nothing.
  [[nodiscard]] CardiacCycle cycle_at(Instant t) const noexcept;

  // Whether the coming cycles can be predicted. In atrial fibrillation the deviations are honest, but large.
  [[nodiscard]] Rhythm rhythm() const noexcept { return rhythm_; }
  // The last sample of a connected lead that has been looked through.
  [[nodiscard]] Instant heard_until() const noexcept { return heard_until_; }

  [[nodiscard]] const PhaseLawSettings& law() const noexcept { return law_.settings; }
  [[nodiscard]] const LawBelief& law_belief() const noexcept { return law_; }
  [[nodiscard]] std::uint64_t beats() const noexcept { return beats_; }  // R peaks taken since the start

 private:
  friend class CardiacClockTracker;

  struct Beat {
    Instant time;
    Duration deviation{0};
    std::uint32_t index_in_run = 0;  // 0 for the first beat and for the first after a gap
    BeatClass beat_class = BeatClass::kNormal;
    Duration irregularity{0};  // by how much the interval before it missed its prediction, 0 when in rhythm
    bool teaches = false;      // the cycle before it does
    bool resumed = false;  // its run began after an interruption shorter than a loss: the rhythm is known from before
    bool unheard = false;  // the images show that a cycle began: no R peak is known
  };

  struct Located {
    CardiacCycle cycle;
    Duration irregularity{0};
    PhaseState state = PhaseState::kUnknown;
    bool exact = false;
    bool ectopic = false;
  };

  // No beat can be heard by now, or one that was due has not been. What the images carry on, they would have shown.
  [[nodiscard]] bool unheard() const noexcept { return (interrupted_ || now_ > expected_until()) && !carried_; }
  void push(const Beat& beat) noexcept;
  void carry(const CycleCorrection& correction) noexcept;
  [[nodiscard]] PhaseState carried_state() const noexcept {
    return seen_ ? PhaseState::kFromImage : PhaseState::kFreeRunning;
  }
  [[nodiscard]] Located locate(Instant t) const noexcept;
  [[nodiscard]] Located locate_completed(int newer) const noexcept;
  [[nodiscard]] Located locate_predicted(Instant t) const noexcept;
  [[nodiscard]] const Beat& beat(int i) const noexcept { return history_[static_cast<std::size_t>(i)]; }

  LawBelief law_;
  Duration lost_after_{0};
  Duration detector_delay_{0};
  std::uint64_t beats_ = 0;
  int held_ = 0;
  std::array<Beat, kCompletedCycles + 2> history_{};  // newest first; one more cycle gives the oldest its RR_previous
  std::array<Seconds, kPredictedCycles> predicted_{};
  Seconds length_deviation_{0.0};     // of the prediction by one cycle
  Seconds running_deviation_{0.0};    // of the running cycle's length
  Seconds next_deviation_{0.0};       // of the length of the cycle after it
  Seconds premature_deviation_{0.0};  // that a premature beat adds to a cycle which nobody has heard
  Duration given_way_{0};             // the running cycle begins so much after its R peak
  bool contradicted_ = false;
  bool samples_ = false;      // there are samples to be heard, not pulses alone
  bool interrupted_ = false;  // the lead is off, or nothing comes
  bool carried_ = false;      // see CycleCorrection
  bool seen_ = false;
  Instant heard_until_;
  Instant now_;  // of as_of()
  Rhythm rhythm_ = Rhythm::kUnknown;
};

static_assert(std::is_trivially_copyable_v<CardiacClock>);

}  // namespace perimap
