// Finds R peaks in one ECG lead, causally, sample by sample.
//
// After Pan & Tompkins, "A real-time QRS detection algorithm", IEEE Trans. Biomed. Eng. 32(3), 1985: band-limited
// slope, moving-window energy, two adaptive levels, refractory time, T-wave rule and search back. What differs:
//  - Every threshold is a ratio of levels seen in this signal, so gain does not matter; slope counts by magnitude and
//  the
//    peak by the polarity that prevails, so the lead's polarity does not matter.
//  - Levels are medians and quantiles, so an artefact does not deafen the detector.
//  - A beat must stand out from the quiet part of the last seconds, so that bare noise gives no beats.
//  - The filters average over 20 ms, which takes out 50 Hz mains and 60 Hz by 30 dB.
// The time given is that of the local peak itself: the vertex of a parabola through the samples within 10 ms of it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/phase/r_peak.hpp"
#include "core/time/instant.hpp"

namespace perimap {

class RPeakDetector {
 public:
  // `sample_period` 0: learnt from the first stamps. Rates from 100 to 1000 Hz are supported; at others no peak is
  // found.
  explicit RPeakDetector(Duration sample_period = Duration::zero()) noexcept;

  // The next sample, evenly stamped. A stamp that does not advance is ignored; a gap or a value that is not finite
  // counts as lead off. At most one peak a call; when start-up or search back find several at once, the next calls
  // give the others.
  [[nodiscard]] std::optional<RPeak> push(Instant t, float mV) noexcept;

  // The electrode fell off: forgets the signal and its levels, starts anew with the next sample.
  void lead_off(Instant t) noexcept;

  // The signal has ended: what is still in decision. Call until it gives none.
  [[nodiscard]] std::optional<RPeak> flush() noexcept;

 private:
  static constexpr int kHistory = 1024;      // samples, a power of two; 1 s at the highest rate
  static constexpr int kQuietHistory = 128;  // energies, one each 20 ms
  static constexpr int kLearningCapacity = 32;
  static constexpr int kLevels = 8;  // beats that the levels and the rhythm are medians of
  static constexpr int kQueue = kLearningCapacity + 2;

  // A local maximum of the energy.
  struct Candidate {
    RPeak peak;
    double energy = 0.0;
    double slope = 0.0;   // largest magnitude
    double upward = 0.0;  // largest excursions from the baseline, >= 0
    double downward = 0.0;
  };

  struct Sample {
    Instant time;
    double mV = 0.0;
    double smooth = 0.0;    // mean over 20 ms
    double smoother = 0.0;  // mean of that over 20 ms
    double slope = 0.0;     // |difference| of `smoother` over 20 ms
    double energy = 0.0;    // mean of `slope` over 80 ms
  };

  class Recent {  // the last values; at least one must be held
   public:
    void push(double value) noexcept;
    void clear() noexcept { count_ = 0; }
    [[nodiscard]] int count() const noexcept { return count_ < kLevels ? count_ : kLevels; }
    [[nodiscard]] double median() const noexcept;
    [[nodiscard]] double mean() const noexcept;

   private:
    std::array<double, kLevels> values_{};
    int count_ = 0;
  };

  void restart() noexcept;
  void learn_rate() noexcept;
  void set_rate(Duration sample_period) noexcept;
  void filter(std::int64_t i) noexcept;
  void watch_quiet_level() noexcept;
  [[nodiscard]] bool follow_energy(bool ending) noexcept;
  [[nodiscard]] Candidate measure(std::int64_t energy_peak) const noexcept;
  void locate_peak(std::int64_t centre, Candidate& candidate) const noexcept;
  void take(const Candidate& candidate) noexcept;
  void finish_learning() noexcept;
  void decide(const Candidate& candidate) noexcept;
  void search_back() noexcept;
  void accept(const Candidate& candidate, bool searched_back) noexcept;
  [[nodiscard]] double beat_threshold() const noexcept;
  [[nodiscard]] double rhythm_s() const noexcept;
  [[nodiscard]] bool stands_out(const Candidate& candidate) const noexcept;
  [[nodiscard]] Duration overdue_by(Instant t) const noexcept;
  [[nodiscard]] std::optional<RPeak> pop() noexcept;
  [[nodiscard]] int samples_in(Duration d) const noexcept;
  [[nodiscard]] const Sample& at(std::int64_t i) const noexcept {
    return samples_[static_cast<std::size_t>(i & (kHistory - 1))];
  }
  [[nodiscard]] Sample& at(std::int64_t i) noexcept { return samples_[static_cast<std::size_t>(i & (kHistory - 1))]; }

  // The signal.
  Duration given_period_;
  Instant start_;
  Duration period_{0};     // zero until known
  std::int64_t now_ = -1;  // index of the newest sample since the start of the signal
  std::array<Sample, kHistory> samples_{};
  int smooth_width_ = 1;
  int energy_width_ = 1;

  // The energy's local maxima.
  bool rising_ = true;
  double crest_ = 0.0;
  std::int64_t crest_at_ = 0;
  double trough_ = 0.0;

  // Levels.
  std::array<double, kQuietHistory> quiet_{};
  std::int64_t quiet_count_ = 0;
  double quiet_level_ = 0.0;
  double quantum_mV_ = 0.0;  // smallest step between samples: the converter's resolution
  double noise_level_ = 0.0;
  Recent beat_energy_;
  Recent rr_s_;

  // Decisions.
  bool learning_ = true;
  std::array<Candidate, kLearningCapacity> learnt_{};
  int learnt_count_ = 0;
  bool has_last_ = false;
  Candidate last_;  // the last beat
  bool has_passed_over_ = false;
  Candidate passed_over_;  // the strongest candidate since then that was not taken for a beat
  double upward_ = 0.0;    // excursions of the beats so far, fading mean
  double downward_ = 0.0;
  bool points_up_ = true;

  std::array<RPeak, kQueue> queue_{};
  int queue_begin_ = 0;
  int queue_count_ = 0;
};

}  // namespace perimap
