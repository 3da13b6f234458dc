#include "core/phase/phase_law.hpp"

#include <algorithm>
#include <cmath>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

// Systole may take at most this share of the cycle, and at least the other, whatever the coefficients say.
constexpr double kLongestSystole = 0.75;
constexpr double kShortestSystole = 0.05;

bool warped_stretches(double systole, double rr) noexcept {
  return systole >= kLongestSystole * rr || systole <= kShortestSystole * rr;
}

CyclePhase linear(double s, double rr) noexcept { return {kTwoPi * s / rr, kTwoPi / rr, s / rr, 0.0}; }

CyclePhase warped(const PhaseLawSettings& settings, double s, double rr, double rr_previous) noexcept {
  const double systole = systole_duration(settings, Seconds(rr), Seconds(rr_previous)).count();
  const double slope = systole_slope(settings, Seconds(rr), Seconds(rr_previous));
  const double fraction = settings.systole_fraction;
  CyclePhase result;
  if (s < systole) {
    result = {kTwoPi * fraction * s / systole, kTwoPi * fraction / systole, 0.0, slope * s / systole};
  } else {
    const double diastole = rr - systole;
    const double share = (s - systole) / diastole;
    result = {kTwoPi * (fraction + (1.0 - fraction) * share), kTwoPi * (1.0 - fraction) / diastole, share,
              slope * (1.0 - share)};
  }
  if (warped_stretches(systole, rr)) result.length_sensitivity = s / rr;
  return result;
}

CyclePhase time_locked(const PhaseLawSettings& settings, double s, double rr) noexcept {
  const LockedParts parts = locked_parts(settings, Seconds(rr));
  const double systole = parts.systole.count();
  const double filling = parts.filling.count();
  const double at_systole = settings.locked_systole_phase_rad;
  const double at_filling = settings.locked_filling_phase_rad;
  const double filling_begins = rr - filling;
  CyclePhase result;
  if (s < systole) {
    result = {at_systole * s / systole, at_systole / systole, 0.0, 0.0};
  } else if (s < filling_begins) {
    const double diastasis = filling_begins - systole;
    const double share = (s - systole) / diastasis;
    result = {at_systole + (at_filling - at_systole) * share, (at_filling - at_systole) / diastasis, share, 0.0};
  } else {
    result = {at_filling + (kTwoPi - at_filling) * (s - filling_begins) / filling, (kTwoPi - at_filling) / filling, 1.0,
              0.0};
  }
  if (parts.stretches) result.length_sensitivity = s / rr;
  return result;
}

}  // namespace

Seconds systole_duration(const PhaseLawSettings& settings, Seconds rr, Seconds rr_previous) noexcept {
  const double by_rate = settings.systole_offset_s - settings.systole_slope_s_per_bpm * 60.0 / rr_previous.count();
  return std::max(std::min(Seconds(by_rate), kLongestSystole * rr), kShortestSystole * rr);
}

double systole_slope(const PhaseLawSettings& settings, Seconds rr, Seconds rr_previous) noexcept {
  if (warped_stretches(systole_duration(settings, rr, rr_previous).count(), rr.count())) return 0.0;
  return settings.systole_slope_s_per_bpm * 60.0 / (rr_previous.count() * rr_previous.count());
}

LockedParts locked_parts(const PhaseLawSettings& settings, Seconds rr) noexcept {
  LockedParts parts{settings.locked_systole, settings.locked_filling};
  const Seconds room = kLongestLockedShare * rr;
  parts.stretches = parts.systole + parts.filling > room;
  if (parts.stretches) {
    const double scale = room / (parts.systole + parts.filling);
    parts.systole *= scale;
    parts.filling *= scale;
  }
  return parts;
}

bool stretches(const PhaseLawSettings& settings, Seconds rr, Seconds rr_previous) noexcept {
  switch (settings.law) {
    case PhaseLaw::kWarped:
      return warped_stretches(systole_duration(settings, rr, rr_previous).count(), rr.count());
    case PhaseLaw::kTimeLocked:
      return locked_parts(settings, rr).stretches;
    case PhaseLaw::kLinear:
      break;
  }
  return false;
}

CyclePhase phase_in_cycle(const PhaseLawSettings& settings, Seconds since_r, Seconds rr, Seconds rr_previous) noexcept {
  const double s = std::clamp(since_r.count(), 0.0, rr.count());
  switch (settings.law) {
    case PhaseLaw::kWarped:
      return warped(settings, s, rr.count(), rr_previous.count());
    case PhaseLaw::kTimeLocked:
      return time_locked(settings, s, rr.count());
    case PhaseLaw::kLinear:
      break;
  }
  return linear(s, rr.count());
}

double law_deviation_rad(const LawBelief& belief, double told_rad, Seconds since_r, Seconds rr,
                         Seconds rr_previous) noexcept {
  double square = 0.0;
  for (std::size_t i = 0; i < kPhaseLaws.size(); ++i) {
    if (!(belief.probabilities[i] > 0.0) || kPhaseLaws[i] == belief.settings.law) continue;
    const double difference = phase_in_cycle(belief.with(kPhaseLaws[i]), since_r, rr, rr_previous).phase_rad - told_rad;
    square += belief.probabilities[i] * difference * difference;
  }
  return std::sqrt(square);
}

double law_difference_s(const LawBelief& belief, Seconds rr, Seconds rr_previous) noexcept {
  constexpr int kSteps = 16;
  double largest_s = 0.0;
  for (std::size_t i = 0; i < kPhaseLaws.size(); ++i) {
    if (!(belief.probabilities[i] > 0.0) || kPhaseLaws[i] == belief.settings.law) continue;
    const PhaseLawSettings other = belief.with(kPhaseLaws[i]);
    for (int step = 1; step < kSteps; ++step) {
      const Seconds since_r = step * rr / kSteps;
      const CyclePhase told = phase_in_cycle(belief.settings, since_r, rr, rr_previous);
      const double difference_rad = phase_in_cycle(other, since_r, rr, rr_previous).phase_rad - told.phase_rad;
      largest_s = std::max(largest_s, std::abs(difference_rad) / told.rate_rad_per_s);
    }
  }
  return largest_s;
}

}  // namespace perimap
