// Which law the heart's motion follows between two R peaks, by what the images show.
//
// Under the true law an observed phase differs from the clock's by what the map's own phase is off there: something
// that depends on the phase alone, whatever law the map was learnt under. Under a wrong law it differs from cycle to
// cycle as well, as their lengths do. So each law is judged by the scatter of those differences about their mean in
// each part of the cycle, over cycles whose ends are known. The differences within a cycle share their causes, so a
// cycle counts as one, by Student's likelihood of their mean square (1 degree of freedom): a young map is now and then
// far off in one cycle, whatever the law.
//
// Before there is a map, and where it was learnt under another law, the matches that features start from tell more: a
// motion is fitted to them under each law (LawTrial). Of the features that start together the median counts, as one:
// they share the errors of their camera's poses, of the R peaks and of the heart. What was seen at a time that trials
// have told before does not count again, and there is a most that a trial counts.
//
// The laws are scaled to be the same in a cycle of the usual length, so that the map stays right when the law changes.
//
// No heap, no locks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/kept_phases.hpp"
#include "core/phase/law_memory.hpp"
#include "core/phase/law_trial.hpp"
#include "core/phase/observed_phase.hpp"
#include "core/phase/phase_law.hpp"
#include "core/phase/seconds.hpp"

namespace perimap {

// The law, scaled so that in cycles of length `rr` its phase runs evenly.
[[nodiscard]] PhaseLawSettings law_even_at(PhaseLaw law, Seconds rr) noexcept;

class LawChoice {
 public:
  static constexpr std::size_t kLaws = kPhaseLaws.size();
  static constexpr std::size_t kFewestTrials = 8;

  // In order of time.
  void add(const ObservedPhase& observed) noexcept { kept_.add(observed); }
  // A beat has become known: what was seen in the cycle before it is weighed, unless that one teaches nothing. True
  // when another law is taken.
  bool on_beat(const CardiacClock& clock) noexcept;

  // Of features that start together, in any order, which is not kept; fewer than kFewestTrials that tell something new
  // are passed over. True when another law is taken.
  bool weigh(std::span<LawTrial> trials) noexcept;

  // What an earlier run knew, before the first beat of this one. The means in each part of the cycle are found anew.
  [[nodiscard]] LawMemory memory() const noexcept;
  void recall(const LawMemory& memory) noexcept;

  // Linear until there is evidence. Where cycles differ in length the candidates do too, so that what is learnt and
  // told before the law is known is as uncertain as it is.
  [[nodiscard]] const LawBelief& belief() const noexcept { return belief_; }
  // Mean square difference of a law about its means, in squares of the observations' deviations; 0: nothing was
  // weighed. The mean of the cycles'.
  [[nodiscard]] double scatter(PhaseLaw law) const noexcept;

 private:
  static constexpr int kParts = 24;  // of the cycle
  static constexpr std::uint64_t kCyclesForScale = 6;
  static constexpr std::uint64_t kRhythmicCyclesForScale = 2;  // or so many that no premature beat cut short
  static constexpr std::uint64_t kLengths = 12;                // the last ones, whose mean is the usual one
  static constexpr std::size_t kKept = 256;  // observations: of 3.6 s at least, more than the slowest heart's cycle

  struct Part {
    double weight = 0.0;
    double mean_rad = 0.0;
  };

  [[nodiscard]] bool usual_changes(const CardiacCycle& cycle) noexcept;
  void weigh_again(const CardiacClock& clock) noexcept;
  void scale(Seconds usual) noexcept;
  void weigh(const CardiacCycle& cycle) noexcept;
  [[nodiscard]] std::array<double, kLaws> evidence() const noexcept;
  [[nodiscard]] bool choose() noexcept;
  void believe() noexcept;

  LawBelief belief_;
  std::array<std::array<Part, kParts>, kLaws> parts_{};
  std::array<double, kLengths> lengths_s_{};
  std::uint64_t length_count_ = 0;
  std::uint64_t taught_ = 0;  // cycles
  bool any_in_rhythm_ = false;
  Seconds scale_{0.0};
  double cycles_ = 0.0;  // weighed, older ones fading, here and below
  std::array<double, kLaws> squares_{};
  std::array<double, kLaws> log_likelihoods_{};
  std::array<double, kLaws> trial_log_likelihoods_{};  // and an earlier run's; fading likewise, whatever the scale
  Instant tried_until_;
  KeptPhases<kKept> kept_;
};

}  // namespace perimap
