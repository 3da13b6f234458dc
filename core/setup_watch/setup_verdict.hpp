// What a window's estimate of the set-up means: whether the set-up is in doubt, which of its numbers is to blame, and
// what that does to the surface. Values, to be told in words elsewhere.
#pragma once

#include <array>
#include <cstdint>

#include "core/setup_watch/setup_deviation.hpp"
#include "core/setup_watch/setup_fit.hpp"

namespace perimap {

enum class SetupState : std::uint8_t {
  kUnknown,       // no window was judged yet, or the last one had too little in it, or nothing explains it
  kUndetermined,  // a set-up that is wrong enough to matter would not have shown: the scope has hardly moved
  kConsistent,    // it would have, and has not
  kDoubted
};

struct SetupVerdict {
  SetupState state = SetupState::kUnknown;
  // All ten numbers together, with their deviations.
  SetupVector deviation = SetupVector::Zero();
  SetupVector uncertainty = SetupVector::Zero();
  // What is to blame, as index_of(SetupPart); none unless the state is kDoubted. `blamed_deviation` is what has to be
  // added when nothing else is wrong: zero but for the blamed parts' numbers.
  std::array<bool, kSetupParts.size()> blamed{};
  SetupVector blamed_deviation = SetupVector::Zero();
  SetupVector blamed_uncertainty = SetupVector::Zero();
  // How far the features' mean positions are off by that, root mean square; and by how much such a figure is unsure, of
  // all ten numbers.
  double surface_mm = 0.0;
  double surface_deviation_mm = 0.0;
  double explained = 0.0;  // of chi-squared, by what is most to blame, doubted or not
  double certainty = 0.0;  // that, as a multiple of what a doubt needs
  // What is to be added to the deviation of each published position, RMS of the 3-D norm: what the surface may be off
  // by when one part is wrong, by the chance that it is, for all that the window tells. Of a right set-up it falls as
  // the window tells more.
  double widening_mm = 0.0;
  // Of that what the window has told, and not what it leaves unknown: `surface_mm` as far as it is not chance. 0 of
  // most right set-ups.
  double suspected_mm = 0.0;
  double chi2_with = 0.0;
  double chi2_without = 0.0;
  double freedom = 0.0;
  double scatter = 1.0;
  double error_correlation_s = 0.0;
  int frames = 0;
  int matches = 0;
};

[[nodiscard]] constexpr std::size_t index_of(SetupPart part) noexcept { return static_cast<std::size_t>(part); }

struct SetupVerdictSettings {
  double doubted_mm = 1.0;  // of the surface: what a converged feature may be uncertain by
  // Chi-squared of a part with one number, and what it is more for each further one. 25 are five deviations.
  double doubted_chi2 = 25.0;
  double doubted_chi2_per_number = 3.0;
  double undetermined_mm = 1.5;  // deviation of the surface
  // So much of chi-squared is explained by chance (docs/evidence/setup-watch.md): what is explained beyond is
  // suspected, in the way of James and Stein (Proc. 4th Berkeley Symp. 1961).
  double chance_chi2 = 8.0;
  // What is reckoned with before a window has told anything: that one part is wrong, of which each is as likely, by
  // numbers of so much of the watch's prior deviations (3 degrees, 10 mm, 5 %, 15 px, 25 ms).
  double wrong_probability = 0.3;
  double wrong_by = 0.5;
};

// Parts are blamed one after the other, each time that which explains most of what is left.
[[nodiscard]] SetupVerdict judge_setup(const SetupFit& fit, const SetupVerdictSettings& settings = {});

}  // namespace perimap
