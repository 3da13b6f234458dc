// What phases seen in the images tell of the running cardiac cycle: when it began and how long it will be.
//
// A posterior on a grid of beginnings and lengths: the ECG's R peak and the predicted RR interval with their deviations
// as the prior; each observed phase multiplies it by Student's likelihood (3 degrees of freedom), so that a few wrong
// ones do not move it; and a cycle that should have ended without an R peak seen in spite of the detector's delay
// becomes unlikely. What the newest observation contradicts widens the deviation at once: a premature beat moves the
// heart before its R peak is known. A beat may be known only some frames after it: the observations since then are
// kept, and taken again for the new cycle.
//
// When the ECG tells nothing (the lead is off, or no beat comes), the images carry the phase on: a cycle that has ended
// by what they show is followed by one whose beginning is that end, for so long as is allowed, and not when they too
// have told nothing for kBlind.
//
// The equations, in the code's names; b and l are a candidate's beginning (s after the ECG's R peak) and length (s),
// psi(t; b, l) is phase_of(t, b, l) with its rate psi' and its length sensitivity w, z_k an observed phase of standard
// deviation sigma_k (rad) at t_k. Bayes' rule on a fixed grid is the point-mass filter (Bucy & Senne, "Digital
// synthesis of non-linear filters", Automatica 7, 1971); Student's likelihood in a least-squares problem: Lange, Little
// & Taylor, "Robust statistical modeling using the t distribution", JASA 84, 1989.
//
//   begin_s()           b_i = begin_deviation x beta_i,                  beta_i = -2.5 ... 2.5, 7 of them
//   length_s()          l_j = length_mean + length_deviation x lambda_j, lambda_j = -4 ... 4, 81 of them
//   begin_grid()        prior: log p(b_i, l_j) = -1/2 (beta_i^2 + lambda_j^2)
//   weigh()             likelihood: log p(z_k | b, l) = -(nu + 1) / 2 log(1 + square_k / nu), nu = kFreedom
//                       square_k = (z_k - psi(t_k; b, l))^2 / (sigma_k^2 + loose_k^2)
//                       loose_k = w psi' length_deviation past b + l, in a cycle whose length is predicted; else 0
//   summary()           no R peak known by now: log p = -1/2 overdue^2; 0 while carried
//                       overdue = max(0, now - detector_delay - r_peak - b - l) / kMissedBeatDeviation
//                       posterior: p(b, l) ~ exp of the sum of these; told are its mean and its variance:
//                       max(variance, step^2 / 12) x max(1, misfit / n), n observations, from kEnoughForMisfit on,
//                       misfit = sum_k min(square_k, kLargestSquare) of the likeliest candidate
//   with_trusted_end()  the end e = E[b] + E[l] is told as e + (1 - weight) (length_mean - e), weight by EndTrust
//   correct_next()      the next cycle's length is next_length + length_deviation x lambda_j, with log p(lambda_j) =
//                       -1/2 lambda_j^2 + likelihood of the z_k after e, sigma_k^2 grown by psi'^2 Var[e]
//
// The end that the images foretell of a cycle counts for what such ends have been worth (EndTrust); the rest is the
// rhythm's prediction. The phase seen last stays: the beginning gives way, by 3 % of the length at most.
//
// No heap, no locks.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/phase/cardiac_clock.hpp"
#include "core/phase/cycle_correction.hpp"
#include "core/phase/end_trust.hpp"
#include "core/phase/kept_phases.hpp"
#include "core/phase/observed_phase.hpp"
#include "core/phase/phase_law.hpp"
#include "core/time/instant.hpp"

namespace perimap {

class CyclePosterior {
 public:
  static constexpr Duration kBlind = std::chrono::seconds(3);

  // `carry` is how long the images may carry the phase on.
  explicit CyclePosterior(Duration carry = std::chrono::seconds(10)) noexcept : carry_(carry) {}

  // Before each frame: the clock as the ECG has it. A beat more begins a new cycle; while it is not locked, so does the
  // end of the last as the images show it. Under another law the running one is begun again.
  void follow(const CardiacClock& clock, Instant now) noexcept;

  // In order of time. Ignored before the clock is locked.
  void add(const ObservedPhase& observed) noexcept;
  // The images fit no phase near the predicted one. Until one is observed, or a beat comes, the deviation is wide.
  void add_contradiction() noexcept { contradicted_ = true; }

  // Of the running cycle; beats = 0 when nothing was observed in it, or the clock is not locked.
  [[nodiscard]] CycleCorrection correction() const noexcept;

 private:
  static constexpr int kLengths = 81;
  static constexpr int kBeginnings = 7;
  static constexpr std::size_t kKept = 128;  // observations: of 1.8 s at least, and a beat may be told 0.95 s late

  struct Candidate {
    double log_likelihood = 0.0;
    double misfit = 0.0;  // sum of squared normalised residuals, each at most 9
  };

  // Mean and variance of the posterior.
  struct Summary {
    double begin_s = 0.0;  // after the R peak of the ECG
    double length_s = 0.0;
    double begin_variance_s2 = 0.0;
    double length_variance_s2 = 0.0;

    [[nodiscard]] double end_s() const noexcept { return begin_s + length_s; }
    [[nodiscard]] double end_variance_s2() const noexcept { return begin_variance_s2 + length_variance_s2; }
  };

  void begin_cycle(const CardiacClock& clock) noexcept;
  void carry_on(const CardiacClock& clock) noexcept;
  void begin_grid() noexcept;
  void weigh(const ObservedPhase& observed) noexcept;
  // None where the candidates' weights are no numbers.
  [[nodiscard]] std::optional<Summary> summary() const noexcept;
  // The length sensitivity of the phase seen last in such a cycle; 1 past its end.
  [[nodiscard]] double seen_sensitivity(double begin_s, double length_s) const noexcept;
  void foretell() noexcept;
  // The same with its end moved towards the predicted one by what the images' ends are not worth.
  [[nodiscard]] Summary with_trusted_end(const Summary& seen) const noexcept;
  // Where a cycle must begin that ends at `end_s` and has, when seen last, the phase that `seen` has. None when that is
  // further than kLargestGivingWay from where `seen` begins.
  [[nodiscard]] std::optional<double> beginning_for(const Summary& seen, double end_s) const noexcept;
  // Phase and rate at an instant if the cycle began then and lasted so long, and the next one too.
  [[nodiscard]] CyclePhase phase_of(Instant t, double begin_s, double length_s, double next_s) const noexcept;
  // By how much the newest observation contradicts that cycle, s; 0 while it lies within its own deviation.
  [[nodiscard]] double contradiction_s(double begin_s, double length_s,
                                       const CycleCorrection& correction) const noexcept;
  void correct_next(double begin_s, double length_s, double end_variance_s2,
                    CycleCorrection& correction) const noexcept;
  [[nodiscard]] double begin_s(int i) const noexcept;  // after the R peak of the ECG
  [[nodiscard]] double length_s(int j) const noexcept;
  [[nodiscard]] EndTrust& trust() noexcept { return trust_[index_of(law_.law)]; }
  [[nodiscard]] const EndTrust& trust() const noexcept { return trust_[index_of(law_.law)]; }
  // Of the end of the running cycle by the ECG alone.
  [[nodiscard]] double predicted_variance_s2() const noexcept {
    return begin_deviation_s_ * begin_deviation_s_ + length_deviation_s_ * length_deviation_s_;
  }
  [[nodiscard]] Candidate& candidate(int i, int j) noexcept {
    return grid_[static_cast<std::size_t>(i * kLengths + j)];
  }

  Duration carry_;
  bool locked_ = false;   // there is a running cycle
  bool carried_ = false;  // the ECG tells nothing
  Instant carried_since_;
  int ahead_ = 0;  // cycles since the last known R peak, carried
  bool any_observed_ = false;
  Instant last_observed_;
  std::uint64_t beats_ = 0;
  PhaseLawSettings law_;
  Instant now_;
  Instant r_peak_;
  Duration detector_delay_{0};
  double begin_deviation_s_ = 0.0;
  double length_mean_s_ = 0.0;
  double length_deviation_s_ = 0.0;  // of any cycle, as predicted; as much at least as the grid can tell
  double previous_length_s_ = 0.0;
  double next_length_s_ = 0.0;
  bool contradicted_ = false;
  int observed_ = 0;
  Instant seen_until_;                               // the newest instant observed in the running cycle
  std::array<EndTrust, kPhaseLaws.size()> trust_{};  // under each law
  std::array<Candidate, kLengths * kBeginnings> grid_{};
  KeptPhases<kKept> kept_;
};

}  // namespace perimap
