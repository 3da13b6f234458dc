#include "core/phase/respiration_search.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

using Eigen::Vector3d;

constexpr int kBreathColumns = 2 * kBreathHarmonics;  // cosines, -sines
// Neighbouring tenths of a second err alike (the map is the same), so that so many count for one. Measured on simulated
// hearts: with 5 the period found was off by up to five of its deviations, with 20 by two and a half.
constexpr double kErrorsInCommon = 20.0;
// A fit of a longer period holds the shorter one as its second harmonic: the shorter wins unless this much better.
constexpr double kClearlyBetter = 0.8;
constexpr int kRefinements = 24;
constexpr double kNarrowest_rad_per_s = 1e-4;  // a tenth of what the rate is known to at best
// Slower candidates than may be found are tried too, so that what is found is no slower one's nearest neighbour.
constexpr double kLeastBreaths = 1.5;
constexpr double kBreathsOfKnownRate = 2.0;

}  // namespace

Vector3d BreathWave::at(double phase_rad) const noexcept {
  Vector3d p = Vector3d::Zero();
  for (int k = 0; k < kBreathHarmonics; ++k) {
    p += std::cos((k + 1) * phase_rad) * a[k] - std::sin((k + 1) * phase_rad) * b[k];
  }
  return p;
}

Vector3d BreathWave::slope_at(double phase_rad) const noexcept {
  Vector3d slope = Vector3d::Zero();
  for (int k = 0; k < kBreathHarmonics; ++k) {
    slope -= (k + 1) * (std::sin((k + 1) * phase_rad) * a[k] + std::cos((k + 1) * phase_rad) * b[k]);
  }
  return slope;
}

double BreathWave::slope_mm_per_rad() const noexcept {
  double square = 0.0;
  for (int k = 0; k < kBreathHarmonics; ++k) {
    square += 0.5 * (k + 1) * (k + 1) * (a[k].squaredNorm() + b[k].squaredNorm());
  }
  return std::sqrt(square);
}

double BreathWave::rms_mm() const noexcept {
  double square = 0.0;
  for (int k = 0; k < kBreathHarmonics; ++k) square += 0.5 * (a[k].squaredNorm() + b[k].squaredNorm());
  return std::sqrt(square);
}

BreathWave BreathWave::shifted(double phase_rad) const noexcept {
  BreathWave wave;
  for (int k = 0; k < kBreathHarmonics; ++k) {
    const double c = std::cos((k + 1) * phase_rad);
    const double s = std::sin((k + 1) * phase_rad);
    wave.a[k] = c * a[k] - s * b[k];
    wave.b[k] = s * a[k] + c * b[k];
  }
  return wave;
}

bool FoundBreath::reaches(double least_explained, double least_rms_mm, double largest_deviation_rad) const noexcept {
  return explained >= least_explained && wave.rms_mm() >= least_rms_mm &&
         std::sqrt(phase_variance_rad2) <= largest_deviation_rad;
}

double alignment(const BreathWave& wave, const BreathWave& other) noexcept {
  const auto likeness = [&](double phase_rad) {
    const BreathWave turned = wave.shifted(phase_rad);
    double sum = 0.0;
    for (int k = 0; k < kBreathHarmonics; ++k) sum += turned.a[k].dot(other.a[k]) + turned.b[k].dot(other.b[k]);
    return sum;
  };
  constexpr int kSteps = 64;
  double best = 0.0;
  for (int i = 1; i < kSteps; ++i) {
    if (likeness(kTwoPi * i / kSteps) > likeness(best)) best = kTwoPi * i / kSteps;
  }
  double step = kTwoPi / kSteps;
  for (int i = 0; i < kRefinements; ++i) {
    if (likeness(best + step) > likeness(best)) best += step;
    if (likeness(best - step) > likeness(best)) best -= step;
    step *= 0.6;
  }
  return best;
}

void RespirationSearch::add(Instant t, const Vector3d& displacement_mm, double cardiac_phase_rad) noexcept {
  if (count_ == 0 || t - bin(count_ - 1).begin >= kBin) {
    bins_[static_cast<std::size_t>(count_ % kBins)] = Bin{.begin = t};
    ++count_;
  }
  Bin& newest = bins_[static_cast<std::size_t>((count_ - 1) % kBins)];
  newest.time_sum_s += to_seconds(t - newest.begin);
  newest.sum_mm += displacement_mm;
  for (int k = 0; k < kCardiacHarmonics; ++k) {
    newest.cardiac_sum[static_cast<std::size_t>(2 * k)] += std::cos((k + 1) * cardiac_phase_rad);
    newest.cardiac_sum[static_cast<std::size_t>(2 * k + 1)] += std::sin((k + 1) * cardiac_phase_rad);
  }
  ++newest.count;
}

// The normal equations at one candidate rate, and their solution.
struct RespirationSearch::Fit {
  static constexpr int kColumns = kOther + kBreathColumns;
  Eigen::Matrix<double, kColumns, kColumns> A = Eigen::Matrix<double, kColumns, kColumns>::Zero();
  Eigen::Matrix<double, kColumns, 3> B = Eigen::Matrix<double, kColumns, 3>::Zero();
  double square = 0.0;  // of the displacements, mm^2
  Eigen::Matrix<double, kColumns, 3> coefficients;
  double residual = 0.0;  // sum of squares, mm^2

  // The residual of all the rest alone.
  [[nodiscard]] double residual_without_breath() const noexcept {
    const Eigen::Matrix<double, kOther, kOther> A_0 = A.topLeftCorner<kOther, kOther>();
    const Eigen::Matrix<double, kOther, 3> B_0 = B.topRows<kOther>();
    return square - A_0.ldlt().solve(B_0).cwiseProduct(B_0).sum();
  }
};

double RespirationSearch::span_s(std::uint64_t first) const noexcept {
  return to_seconds(bin(count_ - 1).begin - bin(first).begin);
}

RespirationSearch::Fit RespirationSearch::fit(double rate_rad_per_s, std::uint64_t first) const noexcept {
  const Instant reference = bin(count_ - 1).begin;
  const double span = span_s(first);
  Fit result;
  for (std::uint64_t i = first; i < count_; ++i) {
    const Bin& at = bin(i);
    const double n = at.count;
    const double t_s = to_seconds(at.begin - reference) + at.time_sum_s / n;
    const Vector3d y = at.sum_mm / n;
    Eigen::Matrix<double, Fit::kColumns, 1> row;
    row(0) = 1.0;
    row(1) = t_s / span;
    for (std::size_t k = 0; k < at.cardiac_sum.size(); ++k) row(2 + static_cast<int>(k)) = at.cardiac_sum[k] / n;
    const double c = std::cos(rate_rad_per_s * t_s);
    const double s = std::sin(rate_rad_per_s * t_s);
    row(kOther) = c;
    row(kOther + 1) = c * c - s * s;
    row(kOther + 2) = -s;
    row(kOther + 3) = -2.0 * s * c;
    result.A.noalias() += row * row.transpose();
    result.B.noalias() += row * y.transpose();
    result.square += y.squaredNorm();
  }
  result.coefficients = result.A.ldlt().solve(result.B);
  result.residual = std::max(0.0, result.square - result.coefficients.cwiseProduct(result.B).sum());
  return result;
}

double RespirationSearch::refine(double rate_rad_per_s, double width_rad_per_s, std::uint64_t first) const noexcept {
  if (!(width_rad_per_s > kNarrowest_rad_per_s)) return rate_rad_per_s;
  double best = rate_rad_per_s;
  double best_residual = fit(best, first).residual;
  double width = width_rad_per_s;
  for (int i = 0; i < kRefinements && width > kNarrowest_rad_per_s; ++i) {
    for (const double rate : {best - width, best + width}) {
      const double residual = fit(rate, first).residual;
      if (residual < best_residual) {
        best = rate;
        best_residual = residual;
      }
    }
    width *= 0.6;
  }
  return best;
}

bool RespirationSearch::find(FoundBreath& found) const noexcept {
  if (count_ - oldest() < kLeastBins) return false;
  const double span = span_s(oldest());
  const double longest_s = std::min(to_seconds(settings_.longest_period), span / kLeastBreaths);
  const double fastest = kTwoPi / to_seconds(settings_.shortest_period);
  const double slowest = kTwoPi / longest_s;
  if (!(slowest < fastest)) return false;

  const double step = kTwoPi / (6.0 * span);
  double best = fastest;
  double best_residual = fit(fastest, oldest()).residual;
  const int slower = static_cast<int>((fastest - slowest) / step);
  for (int i = 1; i <= slower; ++i) {
    const double rate = fastest - i * step;
    const double residual = fit(rate, oldest()).residual;
    // Against the neighbouring rates the least counts; against a faster one that is already good, a clear gain does.
    const bool near = best - rate < 2.5 * step;
    if (residual < (near ? 1.0 : kClearlyBetter) * best_residual) {
      best = rate;
      best_residual = residual;
    }
  }
  best = refine(best, 0.5 * step, oldest());
  // At the end of the range the best candidate may be any faster motion's neighbour.
  if (kTwoPi / best * settings_.breaths > span || best > fastest - 0.5 * step) return false;
  found = surest(best, 0.5 * step, settings_.breaths);
  if (found.rate_rad_per_s > fastest) return false;
  // What the map learns in its first breath is wrong by what the phase drifts off in it.
  const double largest = settings_.rate_deviation * found.rate_rad_per_s;
  return is_known(found) && found.rate_variance_rad2_per_s2 <= largest * largest;
}

bool RespirationSearch::find_at(double rate_rad_per_s, FoundBreath& found) const noexcept {
  if (count_ - oldest() < kLeastBins || rate_rad_per_s * span_s(oldest()) < kTwoPi * kBreathsOfKnownRate) return false;
  found = surest(rate_rad_per_s, 0.0, kBreathsOfKnownRate);
  return is_known(found);
}

FoundBreath RespirationSearch::lately(double rate_rad_per_s) const noexcept {
  if (!(rate_rad_per_s > 0.0) || count_ - oldest() < kLeastBins) return {};
  const double window_s = settings_.breaths * kTwoPi / rate_rad_per_s;
  std::uint64_t first = oldest();
  while (span_s(first) > window_s && count_ - first > kLeastBins) ++first;
  return breath_at(rate_rad_per_s, true, first);
}

FoundBreath RespirationSearch::surest(double rate_rad_per_s, double width_rad_per_s, double breaths) const noexcept {
  constexpr auto kBinsASecond = static_cast<std::uint64_t>(std::chrono::seconds(1) / kBin);
  static_assert(kBinsASecond < kLeastBins);
  const bool known = !(width_rad_per_s > 0.0);
  FoundBreath best = breath_at(rate_rad_per_s, known, oldest());
  for (int second = 1; second <= settings_.seconds_left_out; ++second) {
    const std::uint64_t first = oldest() + static_cast<std::uint64_t>(second) * kBinsASecond;
    if (count_ < first + kLeastBins) break;
    const double rate = refine(rate_rad_per_s, width_rad_per_s, first);
    if (rate * span_s(first) < kTwoPi * breaths) break;
    const FoundBreath found = breath_at(rate, known, first);
    if (found.phase_variance_rad2 < best.phase_variance_rad2) best = found;
  }
  return best;
}

bool RespirationSearch::is_known(const FoundBreath& found) const noexcept {
  return found.reaches(settings_.explained, settings_.least_rms_mm, settings_.phase_deviation_rad);
}

FoundBreath RespirationSearch::breath_at(double rate_rad_per_s, bool known, std::uint64_t first) const noexcept {
  FoundBreath found;
  const auto bins = static_cast<int>(count_ - first);
  const double span = span_s(first);
  const Fit fitted = fit(rate_rad_per_s, first);
  found.time = bin(count_ - 1).begin;
  found.rate_rad_per_s = rate_rad_per_s;
  const double without = fitted.residual_without_breath();
  found.explained = without > 0.0 ? 1.0 - fitted.residual / without : 0.0;
  for (int k = 0; k < kBreathHarmonics; ++k) {
    found.wave.a[k] = fitted.coefficients.row(kOther + k).transpose();
    found.wave.b[k] = fitted.coefficients.row(kOther + kBreathHarmonics + k).transpose();
  }
  // Cramer-Rao for phase and frequency of a known wave in white noise (Rife & Boorstyn, IEEE Trans. IT 20, 1974), taken
  // to the newest instant.
  const double slope = found.wave.slope_mm_per_rad();
  const double variance_mm2 = fitted.residual / (3.0 * (bins - Fit::kColumns));
  const double centre = kErrorsInCommon * variance_mm2 / (bins * slope * slope);
  found.rate_variance_rad2_per_s2 = known ? 0.0 : 12.0 * centre / (span * span);
  found.covariance_rad2_per_s = 0.5 * span * found.rate_variance_rad2_per_s2;
  found.phase_variance_rad2 = centre + 0.25 * span * span * found.rate_variance_rad2_per_s2;
  return found;
}

}  // namespace perimap
