// The last complexes of a lead, beats and waves alike: which comes before which, and which look alike within one cycle.
// What it tells of a kind of complexes is kept by the clusters.
#pragma once

#include <array>

#include "core/phase/qrs_candidate.hpp"
#include "core/phase/qrs_clusters.hpp"
#include "core/phase/r_peak_detector_settings.hpp"

namespace perimap {

class RecentComplexes {
 public:
  explicit RecentComplexes(const DecisionSettings& settings) noexcept : settings_(settings) {}

  // A complex of a cluster was seen; of the others those are not later by more than some samples. `learnt`: its shape
  // counts for the cluster. Those before it that are blunter and within a PR interval, `longest_pr`, may be P waves.
  void note(const QrsCandidate& candidate, int cluster, bool learnt, Duration longest_pr,
            QrsClusters& clusters) noexcept;
  // How much the complex noted last looks like a QRS by itself, log odds. `at_first`: little is known of the lead yet.
  void judge(double log_odds, bool at_first, QrsClusters& clusters) noexcept;
  // Another that looks like a QRS as well is nearer to the one noted last than ventricles can contract.
  [[nodiscard]] bool crowded(Duration longest) const noexcept;
  // Of the complexes within the T wave's time before.
  [[nodiscard]] double sharpest_before(Instant t) const noexcept;
  // What nothing has followed, or been like, for so long that nothing will.
  void expire(Instant now, QrsClusters& clusters) noexcept;
  void clear() noexcept { seen_.fill({}); }

 private:
  static constexpr int kSeen = 8;

  struct Seen {
    Instant time;
    double sharpness = 0.0;
    double log_odds = -10.0;  // by itself
    int cluster = -1;         // -1: none was seen
    bool learnt = false;
    bool waits_for_follower = false;
    bool waits_for_rival = false;
  };
  [[nodiscard]] const Seen& newest() const noexcept {
    return seen_[static_cast<std::size_t>((next_ + kSeen - 1) % kSeen)];
  }
  [[nodiscard]] bool likely_at(Instant t) const noexcept;
  [[nodiscard]] bool in_even_rhythm(Instant later, Duration apart) const noexcept;
  void note_rival(Seen& of, const Seen& by, bool at_first, QrsClusters& clusters) const noexcept;

  const DecisionSettings& settings_;
  std::array<Seen, kSeen> seen_{};
  int next_ = 0;
};

}  // namespace perimap
