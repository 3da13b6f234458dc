#include "core/phase/ventricular_evidence.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr double kAlways = -12.75;
constexpr double kUnlike = 3.1;        // a unit of the logarithm,
constexpr double kLeast = 1.0;         // from here
constexpr double kMost = 4.0;          // to here: noise has no upper end
constexpr double kEarly = 1.35;        // a deviation of the rhythm,
constexpr double kLate = -1.0;         // from here, deviations,
constexpr double kFarEarly = 4.0;      // to here
constexpr double kLeastSpread = 0.03;  // of any rhythm
constexpr double kIntervalBefore = 2.8;
constexpr double kCoupled = 3.1;
constexpr double kApart = 1.8;
constexpr double kLongestBefore = 0.7;  // log

}  // namespace

double log_odds(const VentricularEvidence& evidence) noexcept {
  const double early = -evidence.log_rr / (evidence.spread + kLeastSpread);
  return kAlways + kUnlike * std::clamp(std::log(evidence.unlike), kLeast, kMost) +
         kEarly * std::clamp(early, kLate, kFarEarly) +
         kIntervalBefore * std::clamp(evidence.log_rr_before, -1.0, kLongestBefore) +
         (evidence.coupled ? kCoupled
          : evidence.apart ? kApart
                           : 0.0);
}

}  // namespace perimap
