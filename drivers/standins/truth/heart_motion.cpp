#include "drivers/standins/truth/heart_motion.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

struct Cycle {
  Instant start;
  Duration length;
  Duration previous_length;
};

Cycle cycle_at(const std::vector<Instant>& r_peaks, Instant t) noexcept {
  const std::size_t last = r_peaks.size() - 1;
  if (t < r_peaks.front()) {
    const Duration length = r_peaks[1] - r_peaks[0];
    const auto cycles_before = (r_peaks.front() - t + length - Duration(1)) / length;
    return {r_peaks.front() - cycles_before * length, length, length};
  }
  if (t >= r_peaks.back()) {
    const Duration length = r_peaks[last] - r_peaks[last - 1];
    return {r_peaks.back() + (t - r_peaks.back()) / length * length, length, length};
  }
  const auto next = std::upper_bound(r_peaks.begin(), r_peaks.end(), t);
  const auto i = static_cast<std::size_t>(next - r_peaks.begin()) - 1;
  const Duration length = r_peaks[i + 1] - r_peaks[i];
  return {r_peaks[i], length, i > 0 ? r_peaks[i] - r_peaks[i - 1] : length};
}

// A piece of the cycle in which the phase runs evenly from phase_0 at time_0 to phase_1 at time_1.
MotionPhase even(double time, double time_0, double time_1, double phase_0, double phase_1) noexcept {
  const double rate = (phase_1 - phase_0) / (time_1 - time_0);
  return {std::min(phase_0 + rate * (time - time_0), std::nextafter(kTwoPi, 0.0)), rate};
}

}  // namespace

Expected<void> check(const HeartMotion& motion) {
  if (motion.r_peaks.size() < 2) return fail("heart motion: fewer than two R peaks");
  for (std::size_t i = 1; i < motion.r_peaks.size(); ++i) {
    if (motion.r_peaks[i] <= motion.r_peaks[i - 1])
      return fail("heart motion: R peak " + std::to_string(i) + " does not come after the one before");
  }
  const auto inside = [](double value, double low, double high) { return value > low && value < high; };
  switch (motion.law) {
    case MotionLaw::kLinear:
      break;
    case MotionLaw::kWarped:
      if (!inside(motion.systole_fraction, 0.0, 1.0))
        return fail("heart motion: systole fraction is not inside (0, 1)");
      if (!std::isfinite(motion.systole_offset_s) || !std::isfinite(motion.systole_slope_s_per_bpm))
        return fail("heart motion: the systole's offset or slope is not finite");
      break;
    case MotionLaw::kTimeLocked:
      if (motion.locked_systole <= Duration(0) || motion.locked_filling <= Duration(0))
        return fail("heart motion: a time-locked part has no length");
      if (!inside(motion.locked_systole_phase_rad, 0.0, kTwoPi) ||
          !inside(motion.locked_filling_phase_rad, motion.locked_systole_phase_rad, kTwoPi))
        return fail("heart motion: time-locked phases do not ascend inside (0, 2 pi)");
      break;
  }
  if (motion.respiration_period < Duration(0)) return fail("heart motion: the respiration period is negative");
  if (!motion.respiration_mm.allFinite()) return fail("heart motion: the respiration displacement is not finite");
  return {};
}

MotionPhase motion_phase(const HeartMotion& motion, Instant t) noexcept {
  const Cycle cycle = cycle_at(motion.r_peaks, t);
  const double time = to_seconds(t - cycle.start);
  const double rr = to_seconds(cycle.length);
  switch (motion.law) {
    case MotionLaw::kWarped: {
      const double rr_previous = to_seconds(cycle.previous_length);
      const double unbounded = motion.systole_offset_s - motion.systole_slope_s_per_bpm * 60.0 / rr_previous;
      // The regression turns negative above 260 beats a minute; the lower bound keeps the law rising even there.
      const double systole = std::clamp(unbounded, 0.05 * rr, 0.75 * rr);
      const double phase = kTwoPi * motion.systole_fraction;
      return time < systole ? even(time, 0.0, systole, 0.0, phase) : even(time, systole, rr, phase, kTwoPi);
    }
    case MotionLaw::kTimeLocked: {
      const double fixed = to_seconds(motion.locked_systole + motion.locked_filling);
      const double shrink = std::min(1.0, 0.95 * rr / fixed);
      const double systole_end = shrink * to_seconds(motion.locked_systole);
      const double filling_start = rr - shrink * to_seconds(motion.locked_filling);
      if (time < systole_end) return even(time, 0.0, systole_end, 0.0, motion.locked_systole_phase_rad);
      if (time < filling_start)
        return even(time, systole_end, filling_start, motion.locked_systole_phase_rad, motion.locked_filling_phase_rad);
      return even(time, filling_start, rr, motion.locked_filling_phase_rad, kTwoPi);
    }
    case MotionLaw::kLinear:
      break;
  }
  return even(time, 0.0, rr, 0.0, kTwoPi);
}

Vector3d respiration_displacement(const HeartMotion& motion, Instant t) noexcept {
  if (motion.respiration_period <= Duration(0)) return Vector3d::Zero();
  const double cycle =
      to_seconds(t.time_since_epoch() % motion.respiration_period) / to_seconds(motion.respiration_period);
  const double sine = std::sin(std::numbers::pi * cycle);
  return sine * sine * sine * sine * motion.respiration_mm;
}

}  // namespace perimap
