#include "core/phase/qrs_candidate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/statistics/upper_median.hpp"

namespace perimap {

void QrsMeter::set_period(Duration period) noexcept {
  step_ = filter_.samples_in(settings_.shape_step);
  points_before_ = static_cast<int>(settings_.shape_before / (step_ * period));
  points_ = points_before_ + static_cast<int>(settings_.shape_after / (step_ * period)) + 1;
}

// The line has begun so shortly before a sample that it is not seen to be a peak: the filters rise there from nothing.
bool QrsMeter::begins_before(std::int64_t peak) const noexcept {
  return peak < filter_.samples_in(3 * settings_.parabola);
}

QrsShape QrsMeter::shape_at(std::int64_t centre) const noexcept {
  QrsShape shape;
  const std::int64_t first = centre + filter_.slope_delay() - points_before_ * step_;
  if (first + (points_ - 1) * step_ > filter_.now()) return shape;
  shape.points = points_;
  for (int i = 0; i < points_; ++i) {
    shape.slope[static_cast<std::size_t>(i)] = static_cast<float>(filter_.at(first + i * step_).slope);
  }
  return shape;
}

QrsCandidate QrsMeter::about_crest(std::int64_t energy_peak, Polarity polarity, double noise_mV) const noexcept {
  QrsCandidate candidate;
  const std::int64_t centre = std::max<std::int64_t>(energy_peak - filter_.energy_delay(), 0);
  measure_about(centre, candidate);
  std::int64_t top = 0;
  std::int64_t bottom = 0;
  measure_excursions(centre, candidate, top, bottom);
  candidate.points_up = candidate.upward >= candidate.downward;
  if (polarity.known) {
    candidate.points_up = polarity.up ? candidate.downward < settings_.opposite * candidate.upward
                                      : candidate.upward >= settings_.opposite * candidate.downward;
  }
  const std::int64_t peak = candidate.points_up ? top : bottom;
  measure_waves(peak, polarity, noise_mV, candidate);
  if (!begins_before(peak)) candidate.shape = shape_at(peak);
  measure_step(peak, candidate);
  return candidate;
}

QrsCandidate QrsMeter::about_fit(std::int64_t centre, bool upward, Polarity polarity, double noise_mV) const noexcept {
  QrsCandidate candidate;
  candidate.points_up = upward;
  measure_about(centre, candidate);
  candidate.shape = shape_at(centre);
  std::int64_t top = 0;
  std::int64_t bottom = 0;
  measure_excursions(centre, candidate, top, bottom);
  const auto value = [&](std::int64_t i) {
    return filter_.at(std::min(i + filter_.despiked_delay(), filter_.now())).despiked;
  };
  std::int64_t peak = centre;
  const int window = filter_.samples_in(settings_.fit_peak_window);
  for (std::int64_t i = std::max<std::int64_t>(centre - window, 0); i <= centre + window; ++i) {
    if (upward ? value(i) > value(peak) : value(i) < value(peak)) peak = i;
  }
  // A cluster may be centred on another wave of the complex than its largest, by noise when it began: what it fits is
  // left to the maximum of the energy, which is measured about its own peak.
  const double excursion = std::abs(value(peak) - baseline_about(centre));
  if (settings_.opposite * excursion < std::max(candidate.upward, candidate.downward)) candidate.shape.points = 0;
  if (begins_before(peak)) candidate.shape.points = 0;
  measure_step(peak, candidate);
  measure_waves(peak, polarity, noise_mV, candidate);
  return candidate;
}

// The largest means whose middles are within 40 ms of the centre.
void QrsMeter::measure_about(std::int64_t centre, QrsCandidate& candidate) const noexcept {
  const int reach = filter_.energy_width() / 2;
  for (std::int64_t i = std::max<std::int64_t>(centre - reach, 0); i <= centre + reach; ++i) {
    const auto at = [&](int delay) -> const EcgSample& { return filter_.at(std::min(i + delay, filter_.now())); };
    candidate.energy = std::max(candidate.energy, at(filter_.energy_delay()).energy);
    candidate.sharpness = std::max(candidate.sharpness, at(filter_.sharpness_delay()).sharpness);
    candidate.slope = std::max(candidate.slope, std::abs(at(filter_.slope_delay()).slope));
    candidate.rough = std::max(candidate.rough, at(filter_.energy_delay()).rough);
  }
}

// Whether the signal comes back after the complex; when the lead comes off it goes to another level and stays there.
// What was before is looked at in three places: one of them may be on a P or T wave, another lead's level on none.
void QrsMeter::measure_step(std::int64_t peak, QrsCandidate& candidate) const noexcept {
  const auto level = [&](std::int64_t i) {
    return filter_.at(std::clamp<std::int64_t>(i + filter_.smooth_delay(), 0, filter_.now())).smooth;
  };
  const int reach = filter_.samples_in(settings_.step_reach);
  const double after = level(peak + reach);
  double least = std::abs(after - level(peak - reach));
  for (const int halves : {3, 4}) least = std::min(least, std::abs(after - level(peak - halves * reach / 2)));
  candidate.step = least / std::max(candidate.upward + candidate.downward, filter_.quantum_mV());
}

// The median of a stretch of which the complex is the smaller part.
double QrsMeter::baseline_about(std::int64_t centre) const noexcept {
  const std::int64_t last = std::max<std::int64_t>(
      std::min(centre + filter_.samples_in(settings_.peak_window), filter_.now() - filter_.smooth_delay()), 0);
  std::array<double, EcgFilter::kHistory / 2> stretch{};
  auto end = stretch.begin();
  for (std::int64_t i = std::max<std::int64_t>(centre - filter_.samples_in(settings_.baseline_before), 0); i <= last;
       ++i) {
    *end++ = filter_.at(i).mV;
  }
  return end == stretch.begin() ? filter_.at(centre).mV : upper_median(stretch.begin(), end);
}

// The largest excursions from the baseline around sample `centre`, and where they are.
void QrsMeter::measure_excursions(std::int64_t centre, QrsCandidate& candidate, std::int64_t& top,
                                  std::int64_t& bottom) const noexcept {
  const int delay = filter_.smooth_delay();
  const std::int64_t first = std::max<std::int64_t>(centre - filter_.samples_in(settings_.peak_window), 0);
  const std::int64_t last =
      std::max(std::min(centre + filter_.samples_in(settings_.peak_window), filter_.now() - delay), first);

  const double baseline = baseline_about(centre);

  top = first;
  bottom = first;
  const auto smooth_at = [&](std::int64_t i) { return filter_.at(std::min(i + delay, filter_.now())).smooth; };
  for (std::int64_t i = first; i <= last; ++i) {
    if (smooth_at(i) > smooth_at(top)) top = i;
    if (smooth_at(i) < smooth_at(bottom)) bottom = i;
  }
  candidate.upward = std::max(smooth_at(top) - baseline, 0.0);
  candidate.downward = std::max(baseline - smooth_at(bottom), 0.0);
}

// The peak, and other waves that may be meant: which one is R is not known before it is known what the complex is like.
void QrsMeter::measure_waves(std::int64_t peak, Polarity polarity, double noise_mV,
                             QrsCandidate& candidate) const noexcept {
  const QrsWave own = refined(peak, candidate.points_up, noise_mV);
  candidate.time = own.time;
  candidate.deviation = own.deviation;
  const double baseline = baseline_about(peak);
  const auto half = static_cast<int>(settings_.wave_half / filter_.period());
  const std::int64_t last = filter_.now() - filter_.despiked_delay() - half;
  const auto height = [&](std::int64_t i) {
    double sum = 0.0;
    for (std::int64_t k = i - half; k <= i + half; ++k) sum += filter_.at(k + filter_.despiked_delay()).despiked;
    return sum / (2 * half + 1) - baseline;
  };
  candidate.peak_mV = height(std::min(peak, last));
  const int beside = filter_.samples_in(settings_.waves_beside);
  const bool opposite = polarity.known && candidate.points_up != polarity.up;
  double larger_mV = candidate.peak_mV;
  double upright_mV = 0.0;
  std::int64_t larger = peak;
  std::int64_t upright = peak;
  const std::int64_t from = peak - filter_.samples_in(opposite ? settings_.waves_before : settings_.waves_beside);
  for (std::int64_t i = std::max<std::int64_t>(from, half + 1); i <= std::min(peak + beside, last - 1); ++i) {
    const double mV = height(i);
    const double side = mV < 0.0 ? -1.0 : 1.0;
    if (side * mV < side * height(i - 1) || side * mV <= side * height(i + 1)) continue;
    if (i >= peak - beside && std::abs(mV) > std::abs(larger_mV)) {
      larger_mV = mV;
      larger = i;
    }
    if (opposite && (mV > 0.0) == polarity.up && std::abs(mV) > std::abs(upright_mV)) {
      upright_mV = mV;
      upright = i;
    }
  }
  const auto wave = [&](std::int64_t at, double mV) {
    QrsWave other = refined(at, mV > 0.0, noise_mV);
    other.mV = mV;
    return other;
  };
  if (larger != peak) candidate.larger = wave(larger, larger_mV);
  if (upright != peak) candidate.upright = wave(upright, upright_mV);
}

// Parabola a + b u + c u^2 by least squares, fitted again around its own vertex once.
QrsWave QrsMeter::refined(std::int64_t peak, bool upward, double noise_mV) const noexcept {
  const double step_s = to_seconds(filter_.period());
  const int reach = filter_.samples_in(settings_.parabola);
  const int delay = filter_.despiked_delay();
  double vertex_s = 0.0;
  double deviation_s = settings_.deviation_cap_s;
  for (int pass = 0; pass < 2; ++pass) {
    const std::int64_t from = std::max<std::int64_t>(peak - reach, 0);
    const std::int64_t to = std::min(peak + reach, filter_.now() - delay);
    if (peak - from != to - peak) break;  // too close to an end of the signal
    // Centred and evenly spaced, so that b separates from a and c.
    const double offset = filter_.at(peak + delay).despiked;
    double n = 0.0;
    double sum_y = 0.0;
    double sum_uy = 0.0;
    double sum_u2 = 0.0;
    double sum_u2y = 0.0;
    double sum_u4 = 0.0;
    for (std::int64_t i = from; i <= to; ++i) {
      const double u = static_cast<double>(i - peak) * step_s;
      const double y = filter_.at(i + delay).despiked - offset;
      n += 1.0;
      sum_y += y;
      sum_uy += u * y;
      sum_u2 += u * u;
      sum_u2y += u * u * y;
      sum_u4 += u * u * u * u;
    }
    const double b = sum_uy / sum_u2;
    const double c = (n * sum_u2y - sum_u2 * sum_y) / (n * sum_u4 - sum_u2 * sum_u2);
    const double a = (sum_y - c * sum_u2) / n;
    if (upward ? c >= 0.0 : c <= 0.0) break;
    const double limit = static_cast<double>(reach) * step_s;
    vertex_s = std::clamp(-b / (2.0 * c), -limit, limit);
    double squares = 0.0;
    for (std::int64_t i = from; i <= to; ++i) {
      const double u = static_cast<double>(i - peak) * step_s;
      const double residual = filter_.at(i + delay).despiked - offset - (a + b * u + c * u * u);
      squares += residual * residual;
    }
    const double noise = std::max(std::sqrt(squares / std::max(n - 3.0, 1.0)), noise_mV);
    deviation_s = noise / (2.0 * std::abs(c) * std::sqrt(sum_u2));
    const auto shift = static_cast<std::int64_t>(std::lround(vertex_s / step_s));
    if (pass == 0 && shift != 0) {
      peak += shift;
      vertex_s = 0.0;
    } else {
      break;
    }
  }
  int made_up = 0;
  for (std::int64_t i = peak - reach; i <= peak + reach; ++i) made_up += filter_.at(i).made_up ? 1 : 0;
  // Where the peak lies among samples that are missing: uniform.
  deviation_s = std::hypot(deviation_s, made_up * step_s / std::sqrt(12.0));
  QrsWave wave;
  wave.time = filter_.at(peak).time + from_seconds(vertex_s);
  wave.deviation =
      from_seconds(std::min(std::hypot(deviation_s, settings_.deviation_floor_s), settings_.deviation_cap_s));
  return wave;
}

}  // namespace perimap
