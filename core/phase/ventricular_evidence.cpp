#include "core/phase/ventricular_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr double kAlways = -11.85;
constexpr double kPaced = -1.0;        // beside a pacemaker, whose patients have beats of their own as well
constexpr double kUnlike = 3.1;        // a unit of the logarithm,
constexpr double kLeast = 1.0;         // from here
constexpr double kMost = 3.8;          // to here: noise has no upper end
constexpr double kEarly = 1.35;        // a deviation of the rhythm,
constexpr double kLate = -1.0;         // from here, deviations,
constexpr double kFarEarly = 4.0;      // to here
constexpr double kLeastSpread = 0.03;  // of any rhythm
constexpr double kIntervalBefore = 2.8;
constexpr double kCoupled = 3.1;
constexpr double kApart = 1.8;
constexpr double kLongestBefore = 0.7;      // log
constexpr double kNarrower = -3.2;          // a unit of the logarithm,
constexpr double kNarrowest = 0.5;          // to here,
constexpr double kWider = 3.0;              // and a unit the other way,
constexpr double kWidest = 0.5;             // to here
constexpr double kWiderAfterOne = 4.0;      // the same after a ventricular beat,
constexpr double kWideAfterOne = 0.1;       // fully from here on
constexpr double kOwn = -8.0;               // of a paced heart's own beat, which is narrower by more than
constexpr double kOwnFrom = 0.0;            // this,
constexpr double kOwnFully = 0.15;          // fully from here on,
constexpr double kOwnTooEarly = -0.4;       // and comes no earlier than here: log of the interval to the cycle,
constexpr double kOwnInTime = -0.2;         // likewise,
constexpr double kOwnCoupled = 0.09;        // or whose kind comes by intervals that scatter by more than this,
constexpr double kOwnScattered = 0.12;      // fully from here on,
constexpr double kOwnKindTooEarly = -0.45;  // and no earlier on the mean than here,
constexpr double kOwnKindInTime = -0.3;     // likewise

// From 0 to 1 between two limits.
double rising(double value, double from, double to) noexcept {
  return std::clamp((value - from) / (to - from), 0.0, 1.0);
}

}  // namespace

double own_of_paced(const VentricularEvidence& evidence) noexcept {
  if (!evidence.paced) return 0.0;
  // Ventricular beats keep a distance of their own from the beat before, which fibrillation does not.
  const double at_any_time = rising(evidence.kind_scatter, kOwnCoupled, kOwnScattered) *
                             rising(evidence.kind_log_rr, kOwnKindTooEarly, kOwnKindInTime);
  const double in_time = std::max(rising(evidence.log_rr, kOwnTooEarly, kOwnInTime), at_any_time);
  return rising(evidence.narrower, kOwnFrom, kOwnFully) * in_time;
}

double log_odds(const VentricularEvidence& evidence) noexcept {
  const double early = -evidence.log_rr / (evidence.spread + kLeastSpread);
  // A bundle branch is wide as well, but its beats are not early.
  const bool ectopic_after_one = evidence.recurs && evidence.after_one && evidence.kind_log_rr < kCameEarly;
  return kAlways + kUnlike * std::clamp(std::log(evidence.unlike), kLeast, kMost) +
         kEarly * std::clamp(early, kLate, kFarEarly) +
         kIntervalBefore * std::clamp(evidence.log_rr_before, -1.0, kLongestBefore) +
         kNarrower * std::clamp(evidence.narrower, 0.0, kNarrowest) +
         (evidence.recurs ? kWider * std::clamp(-evidence.narrower, 0.0, kWidest) : 0.0) +
         (ectopic_after_one ? kWiderAfterOne * rising(-evidence.narrower, 0.0, kWideAfterOne) : 0.0) +
         (evidence.paced ? kPaced : 0.0) + kOwn * own_of_paced(evidence) +
         (evidence.coupled ? kCoupled
          : evidence.apart ? kApart
                           : 0.0);
}

}  // namespace perimap
