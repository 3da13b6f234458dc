#include "core/phase/qrs_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr double kTwice = 0.7;       // log 2: the beats of one patient differ by so much
constexpr double kThird = 1.1;       // log 3
constexpr double kMostLog = 3.0;     // a factor of 20 is as good as any larger one
constexpr double kUnlike = 0.6;      // correlation of complexes that are not alike,
constexpr double kAlike = 0.95;      // and of those that are
constexpr double kSameSize = 0.3;    // |log(size / the cluster's)| of complexes that are of one kind,
constexpr double kOtherSize = 0.7;   // and of those that are not: an ectopic beat may have a T wave's shape
constexpr double kTWaveEnd = 0.45;   // s / sqrt(cycle in s), the end of the T wave (Bazett 1920)
constexpr double kPr_s = 0.28;       // longest usual PR interval,
constexpr double kPrOfCycle = 0.45;  // and of the cycle: in a fast heart a beat follows another as soon
constexpr double kByChance =
    0.3;  // share of any complexes that something sharper follows; of P waves in 2:1 block half
constexpr double kLeastStay = 0.8;  // change of level to the excursions, from which on the line did not come back
constexpr double kMostOdds = 6.0;   // of a cluster

double log_ratio(double a, double b) noexcept {
  if (!(b > 0.0)) return 0.0;
  return std::clamp(std::log(std::max(a, 1e-12) / b), -kMostLog, kMostLog);
}

}  // namespace

double likeness(double correlation, double gain) noexcept {
  const double shape = std::clamp((correlation - kUnlike) / (kAlike - kUnlike), 0.0, 1.0);
  const double off = std::abs(std::log(std::max(gain, 1e-3)));
  return shape * std::clamp((kOtherSize - off) / (kOtherSize - kSameSize), 0.0, 1.0);
}

EvidenceOf<ComplexEvidence> evidence_of(const QrsCandidate& candidate, const ComplexContext& context) noexcept {
  using Kind = ComplexEvidence;
  EvidenceOf<Kind> v{};
  part(v, Kind::kAlways) = 1.0;
  const double sharp = log_ratio(candidate.sharpness, context.top_sharpness);
  part(v, Kind::kLessSharp) = std::max(-sharp, 0.0);
  part(v, Kind::kBlunt) = std::max(-sharp - kThird, 0.0);
  part(v, Kind::kSharper) = std::max(sharp - kTwice, 0.0);
  const double energy = log_ratio(candidate.energy, context.top_energy);
  part(v, Kind::kLessEnergy) = std::max(-energy, 0.0);
  part(v, Kind::kWeak) = std::max(-energy - kThird, 0.0);
  part(v, Kind::kMoreEnergy) = std::max(energy - kTwice, 0.0);
  // A line of no noise at all has no quiet level.
  part(v, Kind::kQuiet) =
      context.quiet_energy > 0.0 ? std::max(log_ratio(candidate.energy, context.quiet_energy), 0.0) : kMostLog;
  part(v, Kind::kStep) = std::min(candidate.step, 1.0);
  part(v, Kind::kStays) = std::clamp((candidate.step - kLeastStay) / (1.0 - kLeastStay), 0.0, 1.0);
  part(v, Kind::kRough) = std::log1p(candidate.rough / std::max(candidate.energy, 1e-12));
  part(v, Kind::kWide) = std::clamp(energy - sharp, 0.0, 2.0);
  part(v, Kind::kFollowed) = std::max((context.followed - kByChance) / (1.0 - kByChance), 0.0);
  part(v, Kind::kAfterSharper) = std::max(-log_ratio(candidate.sharpness, context.sharpest_before), 0.0);
  return v;
}

EvidenceOf<BeatEvidence> evidence_of(const BeatContext& context) noexcept {
  using Kind = BeatEvidence;
  EvidenceOf<Kind> v{};
  part(v, Kind::kAlways) = 1.0;
  part(v, Kind::kComplex) = context.complex_log_odds;
  const double like = context.like;
  part(v, Kind::kCluster) = like * std::clamp(context.cluster_log_odds, -kMostOdds, kMostOdds);
  const double strange = context.any_recurs ? 1.0 - like : 0.0;
  part(v, Kind::kStrange) = strange;
  part(v, Kind::kStrangeInNoise) = strange * std::min(context.disturbed, 3.0);
  part(v, Kind::kStrangersAround) = strange * std::min(context.strangers, 4.0);
  part(v, Kind::kOtherSize) = like * std::min(std::abs(std::log(std::max(context.gain, 1e-3))), 2.0);
  return v;
}

void add_pair(const PairContext& pair, EvidenceOf<BeatEvidence>& v) noexcept {
  using Kind = BeatEvidence;
  part(v, Kind::kRhythm) = pair.log_rhythm;
  part(v, Kind::kRhythmInNoise) = pair.log_rhythm * std::min(pair.disturbed, 3.0);
  if (!(pair.rr_s > 0.0) || !(pair.before_sharpness > 0.0)) return;
  const double sharper = log_ratio(pair.sharpness, pair.before_sharpness);
  if (pair.rr_s < kTWaveEnd * std::sqrt(pair.cycle_s)) part(v, Kind::kTWave) = std::max(-sharper, 0.0);
  if (pair.rr_s < std::min(kPr_s, kPrOfCycle * pair.cycle_s)) part(v, Kind::kBeforeSharper) = std::max(sharper, 0.0);
}

const EvidenceWeights kFittedWeights{
    {
        2.7,    // kAlways
        -1.1,   // kLessSharp
        -1.75,  // kBlunt
        -1.2,   // kSharper
        -1.0,   // kLessEnergy
        -1.35,  // kWeak
        -1.2,   // kMoreEnergy
        0.33,   // kQuiet
        -1.2,   // kStep
        -4.0,   // kStays
        -1.4,   // kRough
        -0.5,   // kWide
        -7.0,   // kFollowed
        -1.0,   // kAfterSharper
    },
    {
        0.0,   // kAlways
        0.9,   // kComplex
        1.0,   // kCluster
        -0.5,  // kStrange
        -0.5,  // kStrangeInNoise
        -0.3,  // kStrangersAround
        -0.5,  // kOtherSize
        -0.7,  // kTWave
        -3.0,  // kBeforeSharper
        0.5,   // kRhythm
        0.25,  // kRhythmInNoise
    },
};

}  // namespace perimap
