#include "core/phase/end_trust.hpp"

#include <algorithm>

namespace perimap {
namespace {

constexpr double kFade = 1.0 - 1.0 / 60.0;  // as long as the rhythm is remembered
// The images are believed until so much, in squared deviations of the ECG's prediction, has been foretold.
constexpr double kBelief = 2.0;
// A beat that misses its prediction by more than this is clamped to it: one such must not outweigh a minute.
constexpr double kClamp = 4.0;
// Never quite 0: what goes the wrong way by chance must not be for ever.
constexpr double kLeastSlope = 0.03;

}  // namespace

void EndTrust::foretell(const ForetoldEnd& end, double sensitivity) noexcept {
  if (foretold_ || !(sensitivity >= kLeastSensitivity && sensitivity <= kMostSensitivity)) return;
  end_ = end;
  foretold_ = true;
}

void EndTrust::score(Instant r_peak) noexcept {
  if (!foretold_) return;
  foretold_ = false;
  const double deviation_s = to_seconds(end_.deviation);
  const double moved_s = to_seconds(end_.moved);
  const double late_s = std::clamp(to_seconds(r_peak - end_.predicted), -kClamp * deviation_s, kClamp * deviation_s);
  scored_ = kFade * scored_ + 1.0;
  deviation_square_s2_ = kFade * deviation_square_s2_ + deviation_s * deviation_s;
  moved_square_s2_ = kFade * moved_square_s2_ + moved_s * moved_s;
  product_s2_ = kFade * product_s2_ + moved_s * late_s;
  const double belief_s2 = kBelief * deviation_s * deviation_s;
  slope_ = std::clamp((product_s2_ + belief_s2) / (moved_square_s2_ + belief_s2), kLeastSlope, 1.0);
}

// What the images foretell is the true shift and an error. The slope tells the ratio of their variances as it was in
// the cycles scored: of the shift as the prediction's variance was there, of the error where the lever is about 1. From
// there on the error's variance is taken to shrink with the lever.
double EndTrust::weight(double sensitivity, double predicted_variance_s2) const noexcept {
  if (slope_ >= 1.0) return 1.0;
  const double seen = std::clamp(sensitivity, 0.5, 1.0);
  const double error_s2 = deviation_square_s2_ / scored_ * (1.0 - slope_) / slope_ * (1.0 - seen) / seen;
  return predicted_variance_s2 / (predicted_variance_s2 + error_s2);
}

}  // namespace perimap
