// Decides which candidates are R peaks, when that is known, and how sure.
//
// Candidates wait here until they are sure one way or the other. Each is held against levels, clusters and disturbances
// (qrs_evidence), and all that wait against each other and the rhythm (beat_path).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/phase/beat_confidence.hpp"
#include "core/phase/beat_levels.hpp"
#include "core/phase/beat_path.hpp"
#include "core/phase/ecg_levels.hpp"
#include "core/phase/line_disturbances.hpp"
#include "core/phase/pondered.hpp"
#include "core/phase/qrs_candidate.hpp"
#include "core/phase/qrs_clusters.hpp"
#include "core/phase/qrs_evidence.hpp"
#include "core/phase/r_peak.hpp"
#include "core/phase/r_peak_detector_settings.hpp"
#include "core/phase/recent_complexes.hpp"
#include "core/phase/recent_values.hpp"

namespace perimap {

class BeatDecision {
 public:
  BeatDecision(const DecisionSettings& settings, const EcgLevels& levels) noexcept
      : settings_(settings), levels_(levels), complexes_(settings), disturbances_(settings, levels) {}

  // A complex was measured. `one_complex`: what is nearer to another is the same.
  void consider(const QrsCandidate& candidate, Duration one_complex, Instant now) noexcept;
  // Time has passed: tells beats that have become known.
  void decide(Instant now, bool ending) noexcept;
  void restart(Instant now) noexcept;  // the line was broken off: what waits is lost
  void forget() noexcept;
  void fall_silent() noexcept;  // no beat has come for some time: the gain may have changed, or there are none
  void burst() noexcept {       // nothing can be seen: what waits in it is no beat
    count_ = 0;
    hidden_ = true;
  }

  [[nodiscard]] std::optional<RPeak> pop() noexcept;
  // Of what waits so near to `t` and is more likely a beat than not.
  [[nodiscard]] Pondered ponders(Instant t, Duration near) const noexcept;
  [[nodiscard]] const BeatLevels& beats() const noexcept { return beats_; }
  [[nodiscard]] const QrsClusters& clusters() const noexcept { return clusters_; }
  // Nothing like beats is known, or none has come for some time.
  [[nodiscard]] bool learning(Instant now) const noexcept;
  // Since the last silence: beats enough to be known by, and one of a kind and a size known from before.
  [[nodiscard]] bool beats_came() const noexcept { return told_since_silence_ >= settings_.beats_at_start; }
  [[nodiscard]] bool as_before() const noexcept { return as_before_; }
  // Disturbances of late, or, where the next beat is overdue, since the last one of a known kind.
  [[nodiscard]] bool noisy(Instant now) const noexcept;
  // Beats of a known kind came, and the next ought to be there.
  [[nodiscard]] bool overdue(Instant now) const noexcept {
    return clusters_.any_settled() &&
           now - familiar_at_ > std::max(settings_.chaos_after, from_seconds(rhythm_.cycle_s));
  }
  // What is seen now is no measure of beats.
  [[nodiscard]] bool in_burst(Instant now) const noexcept;
  // So many disturbances, and no beat of a known kind among them, that the lead may be off.
  [[nodiscard]] bool chaotic(Instant now) const noexcept {
    return disturbances_.at(now) > settings_.chaos && now - familiar_at_ > settings_.chaos_after;
  }

 private:
  static constexpr int kQueue = BeatPath::kMost + 4;

  struct Waiting {
    QrsCandidate candidate;
    int cluster = -1;
    double correlation = 0.0;
    double gain = 1.0;
    double disturbed = 0.0;
    double probability = 0.0;
    double sharpest_before = 0.0;         // within the T wave's time
    double log_odds = 0.0;                // of the complex alone
    bool noted = false;                   // as a disturbance
    EvidenceOf<BeatEvidence> evidence{};  // but for that of pairs
  };
  // No longer than this share of the cycle, where that is known: the usual one, or the mean where beats come in pairs.
  [[nodiscard]] Duration within_cycle(Duration longest, double share) const noexcept;
  void note_crowding(const Waiting& waiting) noexcept;
  [[nodiscard]] EvidenceOf<ComplexEvidence> complex_evidence(const Waiting& waiting) const noexcept;
  [[nodiscard]] bool lost_at_start(const Waiting& waiting) const noexcept;
  [[nodiscard]] double by_itself(const Waiting& waiting) const noexcept;
  void weigh(Instant now) noexcept;
  [[nodiscard]] double like(const Waiting& waiting) const noexcept;  // to its cluster, where that recurs
  [[nodiscard]] bool followed_by_none(const Waiting& waiting) const noexcept;
  [[nodiscard]] bool unknown_in_noise(const Waiting& waiting) const noexcept;
  [[nodiscard]] bool of_settled_beats(const Waiting& waiting) const noexcept;
  [[nodiscard]] bool familiar(const Waiting& waiting) const noexcept;
  [[nodiscard]] bool strange(const Waiting& waiting) const noexcept;
  [[nodiscard]] bool of_known_kind(const Waiting& waiting) const noexcept;
  [[nodiscard]] double odds_after(const QrsCandidate& last, const Waiting& waiting) const noexcept;
  [[nodiscard]] double odds(int before, int candidate) const noexcept;
  [[nodiscard]] bool known(const Waiting& waiting, Instant now, bool ending) const noexcept;
  void accept(int index, Instant now) noexcept;
  void tell(const Waiting& waiting, Instant now) noexcept;
  [[nodiscard]] bool anywhere(const Waiting& waiting) const noexcept;
  [[nodiscard]] QrsWave r_wave(const Waiting& waiting) const noexcept;
  void refuse(const Waiting& waiting) noexcept;
  [[nodiscard]] BeatCircumstances circumstances(const Waiting& waiting, bool familiar, Instant now) const noexcept;
  void remove(int index, int count) noexcept;
  void learn_rhythm(const Waiting& waiting) noexcept;
  void follow_change(const Waiting& waiting, bool familiar) noexcept;

  const DecisionSettings& settings_;
  const EcgLevels& levels_;
  EvidenceWeights weights_ = kFittedWeights;
  QrsClusters clusters_;
  BeatLevels beats_;
  RhythmModel rhythm_;
  RecentValues<8> rr_s_;
  double rr_deviation_ = 0.05;  // fading mean of |log(interval / cycle)|
  BeatPath path_;
  std::array<Waiting, BeatPath::kMost> waiting_{};  // in order of time
  int count_ = 0;
  RecentComplexes complexes_;
  bool has_last_ = false;
  QrsCandidate last_;  // the last beat
  double last_probability_ = 0.0;
  bool has_sure_ = false;
  QrsCandidate sure_;    // the last of those before it that were told without doubt
  bool hidden_ = false;  // since then others may have come that were not seen
  Instant since_;        // beats have been looked for
  int beats_told_ = 0;
  int told_since_silence_ = 0;
  bool as_before_ = false;
  int changed_to_ = -1;    // the cluster of the last beat, when it was of no settled kind,
  int changed_count_ = 0;  // and how many in a row were of it
  LineDisturbances disturbances_;
  Instant familiar_at_;  // of the last beat of a settled kind
  Instant evaluated_at_;

  std::array<RPeak, kQueue> queue_{};
  int queue_begin_ = 0;
  int queue_count_ = 0;
};

}  // namespace perimap
