#include "core/phase/r_peak_smoother.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Of the map's phase before the first cycle: it was learnt from R peaks as the ECG has them. After n cycles it follows
// their mean, which moves by a share 1 / (n + 1) of what one is off; what is learnt never ends, so it moves for ever.
constexpr double kMapDeviation_s = 0.003;
constexpr double kLeastMapWalk_s = 0.0001;
// Student's weights, as for the features' matches: the map is wrong in parts of the cycle.
constexpr double kDegrees = 3.0;
constexpr int kPasses = 5;
// What the map gets wrong is alike for about so long.
constexpr double kAlike_s = 0.13;
constexpr Duration kKeptEvery = std::chrono::milliseconds(14);
// Mean square after the weights: about 0.8 where the phases fit, 4 where none does.
constexpr double kMostMisfit = 2.0;
// An R peak that the detector doubts may be off by a tenth of a second, over which the laws are anything but straight:
// the phases would fit elsewhere too.
constexpr Duration kMostDoubt = std::chrono::milliseconds(20);
// No R peak is known better: the phase laws are no better models of a heart.
constexpr double kLeastDeviation_s = 0.0002;
// Of an R peak by what is known of it before the cycle was seen.
constexpr double kMostDeviations = 4.0;
// Of the shorter of its two cycles, whatever the deviations.
constexpr double kMostMoved = 0.25;

}  // namespace

void RPeakSmoother::add(const ObservedPhase& observed) noexcept {
  const bool soon = kept_count_ > 0 && observed.time >= last_kept_ && observed.time - last_kept_ < kKeptEvery;
  if (soon || !(observed.deviation_rad > 0.0)) return;
  last_kept_ = observed.time;
  kept_[kept_count_++ % kKept] = observed;
}

void RPeakSmoother::on_beat(const CardiacClock& ecg) noexcept {
  const std::uint64_t end_beat = ecg.beats();
  const CardiacCycle cycle = ecg.cycle_at(ecg.anchor() - Duration(1));
  if (end_beat < 2 || !cycle.completed || !cycle.teaches || cycle.irregularity != Duration::zero()) return;
  if (std::max(cycle.begin_deviation, cycle.length_deviation) > kMostDoubt) return;
  const auto believed = estimate(ecg, cycle, moved_by_s(end_beat - 2), expected(cycle, end_beat));
  if (!believed) {
    last_end_ = 0;
    return;
  }
  last_ = *believed;
  if (cycles_ >= kFirstCycles) {
    keep(end_beat - 1, kBegin);
    keep(end_beat, kEnd);
  }
  last_end_ = end_beat;
  ++cycles_;
}

// Before what was seen in it counts.
RPeakSmoother::Belief RPeakSmoother::expected(const CardiacCycle& cycle, std::uint64_t end_beat) const noexcept {
  const double begin_s = std::max(kLeastDeviation_s, to_seconds(cycle.begin_deviation));
  const double end_s = std::max(kLeastDeviation_s, to_seconds(cycle.length_deviation));
  const bool follows = last_end_ != 0 && last_end_ + 1 == end_beat;
  Belief belief;
  belief.mean_s(kMap) = last_.mean_s(kMap);
  belief.covariance_s2 = Vector3d(begin_s * begin_s, end_s * end_s, kMapDeviation_s * kMapDeviation_s).asDiagonal();
  if (cycles_ > 0) {
    const double walk_s = std::max(kLeastMapWalk_s, end_s / static_cast<double>(cycles_ + 1));
    belief.covariance_s2(kMap, kMap) = last_.covariance_s2(kMap, kMap) + walk_s * walk_s;
  }
  if (follows) {
    belief.mean_s(kBegin) = last_.mean_s(kEnd);
    belief.covariance_s2(kBegin, kBegin) = last_.covariance_s2(kEnd, kEnd);
    belief.covariance_s2(kBegin, kMap) = belief.covariance_s2(kMap, kBegin) = last_.covariance_s2(kEnd, kMap);
  }
  return belief;
}

// The phases seen in the cycle whose R peaks are later than the ECG's by the first two of `about_s`.
void RPeakSmoother::collect(const CardiacClock& ecg, const CardiacCycle& cycle, const Vector3d& about_s,
                            double before_s, Residuals& residuals) const noexcept {
  const Instant begin = cycle.begin + from_seconds(about_s(kBegin));
  const Duration length = cycle.length + from_seconds(about_s(kEnd) - about_s(kBegin));
  const Duration previous = cycle.previous_length + from_seconds(about_s(kBegin) - before_s);
  residuals.count = 0;
  const auto kept = static_cast<std::size_t>(std::min<std::uint64_t>(kept_count_, kKept));
  for (std::size_t i = 0; i < kept; ++i) {
    const ObservedPhase& seen = kept_[i];
    if (seen.time < begin || seen.time >= begin + length) continue;
    const CyclePhase told = phase_in_cycle(ecg.law(), seen.time - begin, length, previous);
    const double w = told.length_sensitivity;
    const double p = told.previous_sensitivity;
    const double early_s = std::remainder(seen.phase_rad - told.phase_rad, kTwoPi) / told.rate_rad_per_s;
    const Vector3d gradient(-(1.0 - w + p), -w, 1.0);
    residuals.of[residuals.count++] = {gradient,
                                       early_s + gradient(kBegin) * about_s(kBegin) + gradient(kEnd) * about_s(kEnd),
                                       seen.deviation_rad / told.rate_rad_per_s};
  }
}

// Nothing when what comes of it cannot be believed.
std::optional<RPeakSmoother::Belief> RPeakSmoother::estimate(const CardiacClock& ecg, const CardiacCycle& cycle,
                                                             double before_s, const Belief& prior) const noexcept {
  const Matrix3d prior_information = prior.covariance_s2.inverse();
  const double most_s = kMostMoved * to_seconds(std::min(cycle.length, cycle.previous_length));
  Belief belief = prior;
  const auto possible = [&] {
    if (!belief.mean_s.allFinite() || !belief.covariance_s2.allFinite()) return false;
    if (!(belief.covariance_s2.diagonal().array() > 0.0).all()) return false;
    return std::abs(belief.mean_s(kBegin)) <= most_s && std::abs(belief.mean_s(kEnd)) <= most_s;
  };
  Residuals residuals;
  double misfit = 0.0;  // mean; the last pass's
  for (int pass = 0; pass < kPasses; ++pass) {
    if (!possible()) return std::nullopt;
    collect(ecg, cycle, belief.mean_s, before_s, residuals);
    if (residuals.count < kFewestObservations) return std::nullopt;
    Matrix3d seen_information = Matrix3d::Zero();
    Vector3d seen = Vector3d::Zero();
    misfit = 0.0;
    for (std::size_t i = 0; i < residuals.count; ++i) {
      const Residual& residual = residuals.of[i];
      const double square =
          std::pow((residual.value_s - residual.gradient.dot(belief.mean_s)) / residual.deviation_s, 2);
      // The first pass is to come near: an offset of the map's would make all of them outliers.
      const double weight = pass == 0 ? 1.0 : (kDegrees + 1.0) / (kDegrees + square);
      const double information = weight / (residual.deviation_s * residual.deviation_s);
      seen_information += information * residual.gradient * residual.gradient.transpose();
      seen += information * residual.value_s * residual.gradient;
      misfit += weight * square;
    }
    const auto count = static_cast<double>(residuals.count);
    const double alike = std::max(1.0, kAlike_s * count / to_seconds(cycle.length));
    misfit /= count;
    const double share = 1.0 / (alike * (pass == 0 ? 1.0 : std::max(1.0, misfit)));
    belief.covariance_s2 = (prior_information + share * seen_information).inverse();
    belief.mean_s = belief.covariance_s2 * (prior_information * prior.mean_s + share * seen);
  }
  if (!possible() || misfit > kMostMisfit) return std::nullopt;
  for (const State peak : {kBegin, kEnd}) {
    const double far_s = kMostDeviations * std::sqrt(prior.covariance_s2(peak, peak));
    if (std::abs(belief.mean_s(peak) - prior.mean_s(peak)) > far_s) return std::nullopt;
  }
  return belief;
}

CardiacClock RPeakSmoother::moved(const CardiacClock& clock) const noexcept { return clock.with_r_peaks(peaks_); }

double RPeakSmoother::moved_by_s(std::uint64_t beat) const noexcept {
  const MovedRPeak& peak = peaks_[beat % kPeaks];
  return peak.beat == beat ? to_seconds(peak.by) : 0.0;
}

void RPeakSmoother::keep(std::uint64_t beat, State state) noexcept {
  const double deviation_s = std::max(kLeastDeviation_s, std::sqrt(last_.covariance_s2(state, state)));
  peaks_[beat % kPeaks] = {beat, from_seconds(last_.mean_s(state)), from_seconds(deviation_s)};
}

}  // namespace perimap
