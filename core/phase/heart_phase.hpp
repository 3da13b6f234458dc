// The one owner of what is believed of the heart's phase: which law the motion follows (LawChoice), where the running
// cycle began and how long it will be (CyclePosterior), and where the R peaks of completed cycles were (RPeakSmoother).
//
// The ECG's clock is an argument, and three clocks come of it:
//
//   by_ecg()     what the ECG alone tells, under the law that is believed: posterior and smoother have it for their
//                prior, and completed cycles are told anew by it when the law changes;
//   clock()      the belief: by_ecg() with the running cycle as the images correct it. What is searched for, published
//                and reported goes by it; other threads get it from belief() by the same recipe, PhaseBelief::clock();
//   completed()  by_ecg() with the R peaks where they are believed to have been: what is learnt late goes by it.
//
// No heap, no locks. Another patient's heart is another HeartPhase.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/cycle_posterior.hpp"
#include "core/phase/image_phase_answer.hpp"
#include "core/phase/law_choice.hpp"
#include "core/phase/law_memory.hpp"
#include "core/phase/law_trial.hpp"
#include "core/phase/phase_belief.hpp"
#include "core/phase/phase_law.hpp"
#include "core/phase/r_peak_smoother.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct HeartPhaseSettings {
  bool law_from_image = false;                      // false: the law of the ECG's clock holds
  Duration image_alone = std::chrono::seconds(10);  // the images carry the phase on so long without the ECG
};

class HeartPhase {
 public:
  // Trials of the law that wait to be weighed together; more are not taken.
  static constexpr std::size_t kMostTrials = 256;

  // By what a frame's beginning changes how earlier frames are told.
  struct Change {
    bool another_law = false;  // is told: what was learnt under the one before is less certain than it seemed
    bool other_laws = false;   // are told, or possible: completed cycles have other phases, see by_ecg()
    bool beat = false;         // has become known: the cycle that it ends is completed, see completed()
  };

  // `beats` of the ECG's clock are of another patient's heart: they end no cycle of this one.
  explicit HeartPhase(const HeartPhaseSettings& settings = {}, std::uint64_t beats = 0) noexcept
      : settings_(settings), posterior_(settings.image_alone), beats_(beats) {}

  // What features start from has told of the laws.
  void add(const LawTrial& trial) noexcept;
  // Before each frame, in order of time: the ECG's newest clock, as it stands at `now`, the frame's arrival.
  Change begin_frame(const CardiacClock& ecg, Instant now, Instant capture) noexcept;
  // After the frame's features were found: what they show of the phase at its capture.
  void observe(const ImagePhaseAnswer& seen) noexcept;
  // The map is about to be another one, whose phase may be off by something else: what R peaks were weighed against it
  // no longer counts.
  void forget_r_peaks() noexcept { r_peaks_.forget(); }

  [[nodiscard]] const CardiacClock& by_ecg() const noexcept { return by_ecg_; }
  [[nodiscard]] const CardiacClock& clock() const noexcept { return clock_; }
  [[nodiscard]] CardiacClock completed() const noexcept { return r_peaks_.moved(by_ecg_); }
  [[nodiscard]] PhaseBelief belief() const noexcept;
  // CardiacClock::beats() at the last frame.
  [[nodiscard]] std::uint64_t beats() const noexcept { return beats_; }

  // What an earlier run knew of the law, before the first frame of this one.
  [[nodiscard]] LawMemory law_memory() const noexcept { return law_.memory(); }
  void recall(const LawMemory& memory) noexcept {
    if (settings_.law_from_image) law_.recall(memory);
  }

 private:
  void weigh_laws(Instant capture, Change& change) noexcept;
  [[nodiscard]] std::optional<LawBelief> believed_law() const noexcept;

  HeartPhaseSettings settings_;
  LawChoice law_;
  std::array<LawTrial, kMostTrials> trials_{};  // until there are enough
  std::size_t trial_count_ = 0;
  CyclePosterior posterior_;
  RPeakSmoother r_peaks_;
  std::uint64_t beats_;
  CardiacClock by_ecg_;
  CardiacClock clock_;
};

}  // namespace perimap
