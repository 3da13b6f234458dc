// From time to the motion phase of a simulated heart, and its breathing displacement.
#pragma once

#include <cstdint>
#include <numbers>
#include <vector>

#include "core/error/expected.hpp"
#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// How the phase runs from one R peak (0) to the next (2 pi).
enum class MotionLaw : std::uint8_t {
  kLinear,     // evenly
  kWarped,     // systole keeps its own length (as the heart rate before it says), diastole takes the rest evenly
  kTimeLocked  // systole and early filling at fixed times after R, atrial filling before the next, diastasis stretches
};

// Every law is continuous and rises strictly from 0 at each R peak to 2 pi at the next.
struct HeartMotion {
  MotionLaw law = MotionLaw::kLinear;
  std::vector<Instant> r_peaks;  // ascending; covers the time asked for with a margin on both sides

  // Warped: T_s = min(offset - slope * 60 / RR_previous, 0.75 RR), systole's share of the phase `systole_fraction`.
  // The regression of electromechanical systole on heart rate for men: Weissler, Harris & Schoenfeld, Circulation
  // 37:149-159, 1968 (QS2 = 546 - 2.1 HR, ms).
  double systole_fraction = 0.4;
  double systole_offset_s = 0.546;
  double systole_slope_s_per_bpm = 0.0021;

  // Time-locked: the phase reaches locked_systole_phase at locked_systole after R, and locked_filling_phase at
  // locked_filling before the next R. Cycles too short for both shrink the two alike to 95 % of the cycle.
  // The defaults are a linear cycle of 863 ms, the length at which the surface was imaged.
  Duration locked_systole{535'000'000};
  Duration locked_filling{130'000'000};
  double locked_systole_phase_rad = 2.0 * std::numbers::pi * 535.0 / 863.0;
  double locked_filling_phase_rad = 2.0 * std::numbers::pi * (1.0 - 130.0 / 863.0);

  // Breathing moves the heart by respiration_mm * sin^4(pi t / period): at rest most of the time near end-expiration,
  // where t = 0 of the clock lies (Lujan, Larsen, Balter & Ten Haken, Med. Phys. 26:715-720, 1999, n = 2).
  Vector3d respiration_mm = Vector3d::Zero();
  Duration respiration_period{0};  // 0: no breathing
};

struct MotionPhase {
  double phase_rad = 0.0;  // [0, 2 pi)
  double rate_rad_per_s = 0.0;
};

// Two R peaks at least, strictly ascending, and the law's own values in range; the error names what is not.
[[nodiscard]] Expected<void> check(const HeartMotion& motion);

// The motion phase at t. Needs a checked motion. Outside the known R peaks the first or last cycle length goes on.
[[nodiscard]] MotionPhase motion_phase(const HeartMotion& motion, Instant t) noexcept;

// Displacement by breathing at t, mm, in the frame of `respiration_mm`.
[[nodiscard]] Vector3d respiration_displacement(const HeartMotion& motion, Instant t) noexcept;

}  // namespace perimap
