// Finds R peaks in one ECG lead, causally, sample by sample.
//
// Two ways lead to a beat, and whichever knows it first counts:
//  - the energy of the slope has a maximum (after Pan & Tompkins, "A real-time QRS detection algorithm", IEEE Trans.
//    Biomed. Eng. 32(3), 1985: band-limited slope, moving-window energy, adaptive levels, refractory time, T-wave rule,
//    search back);
//  - the slope looks like a QRS complex that this patient has had before (matched filter on running templates), which
//    finds beats in noise that is stronger than they are.
// While the signal is quiet, an unfamiliar shape of a beat's size is a beat (the first ectopic one must not be missed).
// When disturbances of that size have just been seen, it is held until the next familiar beat tells: in rhythm, then
// what came between was noise; a cycle missing, then it was a beat.
//
// Every threshold is a ratio of levels seen in this signal, so gain does not matter; slope counts by magnitude and the
// peak by the polarity that prevails, so the lead's polarity does not matter. A beat must stand out from the quiet part
// of the last seconds, so that bare noise gives no beats. The time given is that of the local peak itself: the vertex
// of a parabola through the samples within 10 ms of it.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "core/phase/ecg_filter.hpp"
#include "core/phase/qrs_shape.hpp"
#include "core/phase/r_peak.hpp"
#include "core/phase/recent_values.hpp"
#include "core/phase/sample_rate.hpp"
#include "core/time/instant.hpp"

namespace perimap {

enum class EcgSignal : std::uint8_t {
  kLearning,  // nothing has stood out from the noise yet, or for some cycles
  kGood,
  kNoisy,    // disturbances of a beat's size within the last seconds
  kFlat,     // the value has hardly changed: a lead that is off, or an amplifier at its limit
  kLeadOff,  // said by the device, or samples that are missing
};

class RPeakDetector {
 public:
  // So long a stretch of missing samples is filled in by a straight line: a third of a normal QRS complex, whose peak
  // may lie in it but which does not go unseen. In a longer one a beat may be hidden.
  static constexpr Duration kBridged = std::chrono::milliseconds(30);

  // Rates from 100 to 1000 Hz are supported; at others no peak is found. The rate is learnt from the stamps; when it
  // turns out to be another, all is learnt anew.
  RPeakDetector() noexcept;

  // The next sample, evenly stamped. A stamp that does not advance is ignored; a value that is not finite is a missing
  // sample. At most one peak a call; when several become known at once, the next calls give the others.
  [[nodiscard]] std::optional<RPeak> push(Instant t, float mV) noexcept;

  // The electrode fell off: forgets the signal, and after 30 s its levels too.
  void lead_off(Instant t) noexcept;

  // The signal has ended: what is still in decision. Call until it gives none.
  [[nodiscard]] std::optional<RPeak> flush() noexcept;

  [[nodiscard]] EcgSignal signal() const noexcept;
  // How often the signal has broken off; in each of them beats may be hidden, and those of the 0.1 s before.
  [[nodiscard]] std::uint64_t interruptions() const noexcept { return interruptions_; }

 private:
  static constexpr int kQuietHistory = 128;  // energies, one each 20 ms
  static constexpr int kLearningCapacity = 32;
  static constexpr int kLevels = 8;  // beats that the levels and the rhythm are medians of
  static constexpr int kPending = 8;
  static constexpr int kFits = 64;  // steps of the matched filter that are remembered
  static constexpr int kQueue = kLearningCapacity + 4;

  struct Candidate {
    RPeak peak;
    double energy = 0.0;
    double slope = 0.0;   // largest magnitude
    double step = 0.0;    // change of level from before to after, to the excursions
    double upward = 0.0;  // largest excursions from the baseline, >= 0
    double downward = 0.0;
    bool points_up = true;
    double correlation = 0.0;  // with the template that it is most like
    double gain = 0.0;         // to that one
    int of = -1;               // that one
  };

  // How much the signal around a sample looks like the templates.
  struct Fit {
    std::int64_t at = 0;
    double correlation = 0.0;
    double gain = 0.0;
    int of = -1;
  };

  void forget() noexcept;
  void interrupt(Instant t, EcgSignal reason) noexcept;
  void restart_signal() noexcept;
  void learn_rate(Instant t, float mV) noexcept;
  void set_rate(Duration sample_period) noexcept;
  [[nodiscard]] bool stands_still(Instant t, float mV, bool anew) noexcept;
  void bridge(Instant from, float from_mV, Instant to, float to_mV) noexcept;
  void take_sample(Instant t, float mV, bool made_up) noexcept;
  void watch_quiet_level() noexcept;
  void watch_roughness() noexcept;
  [[nodiscard]] bool follow_energy() noexcept;
  void follow_templates() noexcept;
  void decide_crests() noexcept;
  [[nodiscard]] QrsShape shape_at(std::int64_t centre) const noexcept;
  [[nodiscard]] Candidate measure(std::int64_t energy_peak) const noexcept;
  [[nodiscard]] Candidate measure_fit(const Fit& fit) const noexcept;
  void measure_excursions(std::int64_t centre, Candidate& candidate, std::int64_t& top,
                          std::int64_t& bottom) const noexcept;
  void measure_step(std::int64_t peak, Candidate& candidate) const noexcept;
  void refine_peak(std::int64_t peak, Candidate& candidate) const noexcept;
  void finish_learning() noexcept;
  [[nodiscard]] const Candidate* strongest_recurring() noexcept;
  [[nodiscard]] bool large_recur(const Candidate& candidate) const noexcept;
  [[nodiscard]] bool too_soon(const Candidate& candidate) const noexcept;
  void decide(const Candidate& candidate) noexcept;
  void decide_new(const Candidate& candidate) noexcept;
  void decide_unfamiliar(const Candidate& candidate) noexcept;
  void decide_familiar(const Fit& fit) noexcept;
  void hold(const Candidate& candidate) noexcept;
  [[nodiscard]] double likelihood(const Candidate& candidate) const noexcept;
  [[nodiscard]] bool sizeable(const Candidate& candidate) const noexcept;
  void pass_over(const Candidate& candidate) noexcept;
  void resolve_overdue() noexcept;
  void accept(const Candidate& candidate, double trust) noexcept;
  void emit(RPeak peak) noexcept;
  void rescale(double factor) noexcept;
  [[nodiscard]] bool is_t_wave(const Candidate& candidate) const noexcept;
  [[nodiscard]] double strength(const Candidate& candidate) const noexcept;
  [[nodiscard]] double beat_threshold() const noexcept;
  [[nodiscard]] double rhythm_s() const noexcept;
  [[nodiscard]] bool stands_out(const Candidate& candidate, double times) const noexcept;
  [[nodiscard]] std::optional<RPeak> pop() noexcept;

  // The signal.
  SampleRate rate_;
  Duration period_{0};  // that is used; zero until known
  std::array<Instant, 17> first_times_{};
  std::array<float, 17> first_values_{};
  int first_count_ = 0;
  EcgFilter filter_;
  Instant start_;
  Duration learnt_for_{0};  // of signal, since the levels were forgotten
  std::uint64_t interruptions_ = 0;
  Instant interrupted_at_;
  bool interrupted_ = false;
  EcgSignal interruption_ = EcgSignal::kLeadOff;
  bool started_ = false;
  bool ending_ = false;
  Instant newest_;
  float newest_mV_ = 0.0F;
  Instant changed_at_;  // when the value last changed,
  Instant left_at_;     // and when it last left the surroundings of
  double level_mV_ = 0.0;

  // The energy's local maxima, and those that wait for what follows them.
  bool rising_ = true;
  double crest_ = 0.0;
  std::int64_t crest_at_ = 0;
  double trough_ = 0.0;
  std::array<std::int64_t, kPending> crests_{};
  int crest_count_ = 0;

  // The matched filter.
  int step_ = 1;  // samples between the points of a shape
  int points_before_ = 0;
  int points_ = 0;
  ShapeTemplates templates_;
  std::array<Fit, kFits> fits_{};
  std::int64_t fit_count_ = 0;
  Fit best_fit_;  // of the maximum that is being passed; none when its `of` is -1

  // Levels.
  std::array<double, kQuietHistory> quiet_{};
  std::int64_t quiet_count_ = 0;
  double quiet_level_ = 0.0;
  double noise_level_ = 0.0;
  double rough_level_ = 0.0;  // the lowest of late
  Instant smooth_at_;         // the last instant that was not rough
  Instant rough_since_;       // nothing can be seen from then
  Instant rough_until_;       // to then
  RecentValues<kLevels> beat_energy_;
  RecentValues<kLevels> beat_slope_;
  RecentValues<kLevels> rr_s_;

  // Decisions.
  double other_gain_ = 0.0;  // of the last beat to its template, when it was far from 1

  bool learning_ = true;
  Instant searching_since_;
  std::array<Candidate, kLearningCapacity> learnt_{};
  int learnt_count_ = 0;
  bool has_last_ = false;
  Candidate last_;  // the last beat
  bool last_familiar_ = false;
  Instant before_last_;  // the beat before it
  bool has_passed_over_ = false;
  Candidate passed_over_;  // the strongest candidate since then that was not taken for a beat
  bool has_held_ = false;
  Candidate held_;       // of a beat's size but unfamiliar, seen in noise
  Instant held_until_;   // then it is a beat
  Instant noisy_until_;  // disturbances of a beat's size have been seen lately
  double upward_ = 0.0;  // excursions of the beats so far, fading mean
  double downward_ = 0.0;
  bool points_up_ = true;

  std::array<RPeak, kQueue> queue_{};
  int queue_begin_ = 0;
  int queue_count_ = 0;
};

}  // namespace perimap
