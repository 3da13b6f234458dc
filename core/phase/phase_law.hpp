// From the time since an R peak to the phase of the heart's motion.
//
// Phase 0 is the R peak. The linear law is that of Tully, Kantor & Choset (ICRA 2013). But systole does not stretch
// with the cycle as diastole does: its length follows the rate of the beat before, nearly linearly (Weissler, Harris &
// Schoenfeld, "Systolic time intervals in heart failure in man", Circulation 37, 1968). The other two laws say so.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "core/phase/seconds.hpp"

namespace perimap {

enum class PhaseLaw : std::uint8_t {
  kLinear,     // evenly from R peak to R peak
  kWarped,     // systole keeps its own length, diastole takes the rest
  kTimeLocked  // systole and early filling follow the R peak, atrial filling precedes the next, diastasis stretches
};

struct PhaseLawSettings {
  PhaseLaw law = PhaseLaw::kLinear;

  // Warped law: systole lasts min(offset - slope * 60 / RR_previous, 0.75 RR) and takes this share of the phase.
  double systole_fraction = 0.4;
  double systole_offset_s = 0.546;
  double systole_slope_s_per_bpm = 0.0021;

  // Time-locked law: the phase reaches `locked_systole_phase_rad` this long after the R peak, and
  // `locked_filling_phase_rad` this long before the next one. In cycles too short for both they shrink in proportion.
  // With these values the law is linear in a cycle of 863 ms.
  Seconds locked_systole{0.535};
  Seconds locked_filling{0.130};
  double locked_systole_phase_rad = 2.0 * std::numbers::pi * 535.0 / 863.0;
  double locked_filling_phase_rad = 2.0 * std::numbers::pi * (1.0 - 130.0 / 863.0);
};

// Systole and filling take at most this share of the cycle under the time-locked law, so that the rate stays finite.
inline constexpr double kLongestLockedShare = 0.95;

// The cycle is too short, or too long, for the law's own lengths: the whole of it stretches with its length. Never
// under the linear law, which has none.
[[nodiscard]] bool stretches(const PhaseLawSettings& settings, Seconds rr, Seconds rr_previous) noexcept;

inline constexpr std::array<PhaseLaw, 3> kPhaseLaws{PhaseLaw::kLinear, PhaseLaw::kWarped, PhaseLaw::kTimeLocked};
// Where in kPhaseLaws it stands.
[[nodiscard]] constexpr std::size_t index_of(PhaseLaw law) noexcept { return static_cast<std::size_t>(law); }

// Which law is told, and which are not ruled out, in order of kPhaseLaws.
struct BelievedLaws {
  PhaseLaw told = PhaseLaw::kLinear;
  std::array<bool, kPhaseLaws.size()> possible{};

  [[nodiscard]] bool undecided() const noexcept { return std::count(possible.begin(), possible.end(), true) > 1; }
  [[nodiscard]] bool operator==(const BelievedLaws&) const noexcept = default;
};

// The law that phases are told by, and how sure that is.
struct LawBelief {
  PhaseLawSettings settings;
  std::array<double, kPhaseLaws.size()> probabilities{};  // of kPhaseLaws; all 0: the law is known

  [[nodiscard]] BelievedLaws laws() const noexcept {
    BelievedLaws laws{settings.law, {}};
    for (std::size_t i = 0; i < kPhaseLaws.size(); ++i)
      laws.possible[i] = probabilities[i] > 0.0 || kPhaseLaws[i] == settings.law;
    return laws;
  }

  // Another law of the same numbers.
  [[nodiscard]] PhaseLawSettings with(PhaseLaw law) const noexcept {
    PhaseLawSettings other = settings;
    other.law = law;
    return other;
  }
};

struct CyclePhase {
  double phase_rad = 0.0;       // [0, 2 pi]
  double rate_rad_per_s = 0.0;  // > 0
  // Seconds by which the phase runs early for each second that the cycle turns out longer: 0 where the motion is bound
  // to the R peak behind, 1 where it is bound to the one ahead.
  double length_sensitivity = 0.0;
  // The same for each second that the cycle before it was longer: under the warped law that one's length sets systole.
  double previous_sensitivity = 0.0;
};

// Duration of systole under the warped law; always within the cycle.
[[nodiscard]] Seconds systole_duration(const PhaseLawSettings& settings, Seconds rr, Seconds rr_previous) noexcept;
// Its derivative by `rr_previous`; 0 where it is a share of the cycle itself.
[[nodiscard]] double systole_slope(const PhaseLawSettings& settings, Seconds rr, Seconds rr_previous) noexcept;

// Under the time-locked law, in a cycle of length `rr`.
struct LockedParts {
  Seconds systole{0.0};    // from the R peak
  Seconds filling{0.0};    // to the next
  bool stretches = false;  // the cycle is too short for both
};
[[nodiscard]] LockedParts locked_parts(const PhaseLawSettings& settings, Seconds rr) noexcept;

// `since_r` below 0 counts as 0 and above `rr` as `rr`: a cycle does not run past its end. `rr` and `rr_previous` must
// be positive.
[[nodiscard]] CyclePhase phase_in_cycle(const PhaseLawSettings& settings, Seconds since_r, Seconds rr,
                                        Seconds rr_previous) noexcept;

// By how much the phase told, that of belief.settings, may be off because the law is another one, rad: root mean square
// difference of the laws' phases from it. It vanishes in cycles of the length at which the laws are even, whatever is
// believed.
[[nodiscard]] double law_deviation_rad(const LawBelief& belief, double told_rad, Seconds since_r, Seconds rr,
                                       Seconds rr_previous) noexcept;
// The most that another law which is not ruled out differs from the told one anywhere in such a cycle, as time.
[[nodiscard]] double law_difference_s(const LawBelief& belief, Seconds rr, Seconds rr_previous) noexcept;

}  // namespace perimap
