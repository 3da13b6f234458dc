// How much a candidate looks like a QRS complex: named evidence, and the log odds that it adds up to.
//
// Logistic regression in two steps: each piece of evidence is a number of order one, its weight says how many natural
// units of log odds one of it is worth. The first step goes by the complex alone, against levels of the signal; nothing
// in it depends on what was taken for a beat before. The second adds what complexes of its cluster were on average by
// the first, disturbances, and what the beat before tells. The weights are fitted on the development records
// (docs/evidence/ecg.md).
#pragma once

#include <array>
#include <cstddef>

#include "core/phase/qrs_candidate.hpp"

namespace perimap {

enum class ComplexEvidence : std::size_t {
  kAlways,        // 1: the prior
  kLessSharp,     // -log(sharpness / that of the largest complexes of late), where less
  kBlunt,         // the same, beyond a third: ectopic beats are less sharp than others, but hardly so
  kSharper,       // with the other sign, where it exceeds twice that
  kLessEnergy,    // likewise by energy: what is smaller than,
  kWeak,          // beyond a third,
  kMoreEnergy,    // and larger by more than twice
  kQuiet,         // log(energy / quiet level), at most 4
  kStep,          // the level has changed, to the excursions
  kStays,         // how near that comes to all of the excursions, from four fifths on: an electrode that moved
  kRough,         // log(1 + what is too fast for a QRS / energy)
  kWide,          // log(energy / sharpness), beside that of the largest complexes
  kFollowed,      // a sharper complex follows most complexes of this cluster, as QRS follows P
  kAfterSharper,  // log(sharpness of the sharpest within the T wave's time before / its own), where more
  kCount
};
enum class BeatEvidence : std::size_t {
  kAlways,
  kComplex,          // log odds by the complex alone
  kCluster,          // their mean over its cluster, by how like it is to that
  kStrange,          // 1 - resemblance to what recurs, 0 to 1, where anything does
  kStrangeInNoise,   // the same, with the disturbances of the last seconds
  kStrangersAround,  // and with others of a beat's size that are like nothing within half a second
  kOtherSize,        // |log(size / the cluster's)|
  kTWave,            // follows a beat as a T wave does, and is less sharp than it
  kBeforeSharper,    // the beat before it was less sharp and within a PR interval
  kRhythm,           // log of the density of the interval, to one without rhythm
  kRhythmInNoise,    // the same, with the disturbances: then shapes tell little
  kCount
};

template <class Kind>
using EvidenceOf = std::array<double, static_cast<std::size_t>(Kind::kCount)>;

template <class Kind>
[[nodiscard]] constexpr double& part(EvidenceOf<Kind>& v, Kind kind) noexcept {
  return v[static_cast<std::size_t>(kind)];
}

template <std::size_t N>
[[nodiscard]] constexpr double log_odds(const std::array<double, N>& evidence,
                                        const std::array<double, N>& weights) noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < N; ++i) sum += evidence[i] * weights[i];
  return sum;
}

struct EvidenceWeights {
  EvidenceOf<ComplexEvidence> complex;
  EvidenceOf<BeatEvidence> beat;
};
extern const EvidenceWeights kFittedWeights;

// How far a complex is one of its cluster, 0 to 1, by the correlation of the shapes and its size to the members'.
[[nodiscard]] double likeness(double correlation, double gain) noexcept;

// What a complex is held against.
struct ComplexContext {
  double top_energy = 0.0;  // of the largest complexes of late
  double top_sharpness = 0.0;
  double quiet_energy = 0.0;
  double followed = 0.0;         // share of its cluster that a sharper one followed, by how like it is to that
  double sharpest_before = 0.0;  // within the T wave's time
};
[[nodiscard]] EvidenceOf<ComplexEvidence> evidence_of(const QrsCandidate& candidate,
                                                      const ComplexContext& context) noexcept;

// What a candidate is held against.
struct BeatContext {
  double complex_log_odds = 0.0;
  double cluster_log_odds = 0.0;
  bool any_recurs = false;  // something does
  double like = 0.0;        // to a cluster that recurs
  double gain = 1.0;        // to its members' size
  double disturbed = 0.0;   // disturbances of the last seconds, fading count
  double strangers = 0.0;   // within half a second
};
[[nodiscard]] EvidenceOf<BeatEvidence> evidence_of(const BeatContext& context) noexcept;

// What it adds that the beat before was another.
struct PairContext {
  double rr_s = 0.0;
  double cycle_s = 0.0;  // usual
  double log_rhythm = 0.0;
  double disturbed = 0.0;
  double before_sharpness = 0.0;
  double sharpness = 0.0;
};
void add_pair(const PairContext& pair, EvidenceOf<BeatEvidence>& v) noexcept;

}  // namespace perimap
