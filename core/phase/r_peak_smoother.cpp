#include "core/phase/r_peak_smoother.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

namespace perimap {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kTwoPi = 2.0 * std::numbers::pi;

// Of the map's phase before the first cycle: it was learnt from R peaks as the ECG has them. After n cycles it follows
// their mean, which moves by a share 1 / (n + 1) of what one is off; what is learnt never ends, so it moves for ever.
constexpr double kMapDeviation_s = 0.003;
constexpr double kLeastMapWalk_s = 0.0001;
// Student's weights, as for the features' matches: the map is wrong in parts of the cycle.
constexpr double kDegrees = 3.0;
constexpr int kPasses = 3;
// What the map gets wrong is alike in so many frames in a row, about.
constexpr double kAlike = 4.0;
// No R peak is known better: the phase laws are no better models of a heart.
constexpr double kLeastDeviation_s = 0.0002;

// One phase seen, against the ECG's, as times.
struct Residual {
  Vector3d gradient;
  double value_s = 0.0;
  double deviation_s = 0.0;
};

}  // namespace

void RPeakSmoother::on_beat(const CardiacClock& ecg) noexcept {
  const std::uint64_t end_beat = ecg.beats();
  const CardiacCycle cycle = ecg.cycle_at(ecg.anchor() - Duration(1));
  if (end_beat < 2 || !cycle.completed || !cycle.teaches || cycle.irregularity != Duration::zero()) return;

  std::array<Residual, kKept> residuals;
  std::size_t count = 0;
  const double before_s = moved_by_s(end_beat - 2);
  for (const ObservedPhase& seen : kept_) {
    if (seen.time < cycle.begin || seen.time >= cycle.begin + cycle.length) continue;
    const CyclePhase told = phase_in_cycle(ecg.law(), seen.time - cycle.begin, cycle.length, cycle.previous_length);
    const double w = told.length_sensitivity;
    const double p = told.previous_sensitivity;
    const double early_s = std::remainder(seen.phase_rad - told.phase_rad, kTwoPi) / told.rate_rad_per_s;
    residuals[count++] = {Vector3d(-(1.0 - w + p), -w, 1.0), early_s - p * before_s,
                          seen.deviation_rad / told.rate_rad_per_s};
  }
  if (count < static_cast<std::size_t>(kFewestObservations)) return;

  begin_cycle(cycle, end_beat);
  const Matrix3d prior_information = covariance_s2_.inverse();
  const Vector3d prior_mean_s = mean_s_;
  for (int pass = 0; pass < kPasses; ++pass) {
    Matrix3d seen_information = Matrix3d::Zero();
    Vector3d seen = Vector3d::Zero();
    double misfit = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const Residual& residual = residuals[i];
      const double square = std::pow((residual.value_s - residual.gradient.dot(mean_s_)) / residual.deviation_s, 2);
      // The first pass is to come near: an offset of the map's would make all of them outliers.
      const double weight = pass == 0 ? 1.0 : (kDegrees + 1.0) / (kDegrees + square);
      const double information = weight / (residual.deviation_s * residual.deviation_s);
      seen_information += information * residual.gradient * residual.gradient.transpose();
      seen += information * residual.value_s * residual.gradient;
      misfit += weight * square;
    }
    const double share = 1.0 / (kAlike * (pass == 0 ? 1.0 : std::max(1.0, misfit / static_cast<double>(count))));
    covariance_s2_ = (prior_information + share * seen_information).inverse();
    mean_s_ = covariance_s2_ * (prior_information * prior_mean_s + share * seen);
  }
  if (cycles_ >= kFirstCycles) {
    keep(end_beat - 1, kBegin);
    keep(end_beat, kEnd);
  }
  last_end_ = end_beat;
  ++cycles_;
}

CardiacClock RPeakSmoother::moved(const CardiacClock& clock) const noexcept { return clock.with_r_peaks(peaks_); }

double RPeakSmoother::moved_by_s(std::uint64_t beat) const noexcept {
  const MovedRPeak& peak = peaks_[beat % kPeaks];
  return peak.beat == beat ? to_seconds(peak.by) : 0.0;
}

// The prior of its times.
void RPeakSmoother::begin_cycle(const CardiacCycle& cycle, std::uint64_t end_beat) noexcept {
  const double begin_s = to_seconds(cycle.begin_deviation);
  const double end_s = to_seconds(cycle.length_deviation);
  const bool follows = last_end_ != 0 && last_end_ + 1 == end_beat;
  Vector3d mean_s(0.0, 0.0, mean_s_(kMap));
  Matrix3d covariance_s2 = Vector3d(begin_s * begin_s, end_s * end_s, kMapDeviation_s * kMapDeviation_s).asDiagonal();
  if (cycles_ > 0) {
    const double walk_s = std::max(kLeastMapWalk_s, end_s / static_cast<double>(cycles_ + 1));
    covariance_s2(kMap, kMap) = covariance_s2_(kMap, kMap) + walk_s * walk_s;
  }
  if (follows) {
    mean_s(kBegin) = mean_s_(kEnd);
    covariance_s2(kBegin, kBegin) = covariance_s2_(kEnd, kEnd);
    covariance_s2(kBegin, kMap) = covariance_s2(kMap, kBegin) = covariance_s2_(kEnd, kMap);
  }
  mean_s_ = mean_s;
  covariance_s2_ = covariance_s2;
}

void RPeakSmoother::keep(std::uint64_t beat, State state) noexcept {
  const double deviation_s = std::max(kLeastDeviation_s, std::sqrt(covariance_s2_(state, state)));
  peaks_[beat % kPeaks] = {beat, from_seconds(mean_s_(state)), from_seconds(deviation_s)};
}

}  // namespace perimap
