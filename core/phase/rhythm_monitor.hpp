// Whether the next cycle can be predicted at all: atrial fibrillation told from regular and from patterned rhythms.
//
// In atrial fibrillation each interval says next to nothing of the following one. The coefficient of sample entropy
// (D. E. Lake, J. R. Moorman, "Accurate estimation of entropy in very short physiological time series: the problem of
// atrial fibrillation detection in implanted ventricular devices", Am. J. Physiol. Heart Circ. Physiol. 300, 2011)
// measures just that from some tens of intervals: how much rarer than by chance two similar intervals are followed by
// two similar ones. Bigeminy and trigeminy repeat themselves and stay below. Deep breathing may not, but there the
// AR(8) prediction works; only when that fails as well is the rhythm called unpredictable.
#pragma once

#include <array>
#include <cstdint>

#include "core/phase/rr_predictor.hpp"
#include "core/phase/seconds.hpp"

namespace perimap {

enum class Rhythm : std::uint8_t {
  kUnknown,        // too few intervals yet
  kPredictable,    // sinus rhythm, also with ectopic beats
  kUnpredictable,  // the intervals are random, as in atrial fibrillation: the coming phase cannot be predicted
  kEctopic         // ectopic beats prevail, as in bigeminy: hardly a cycle lies between normal beats
};

class RhythmMonitor {
 public:
  static constexpr int kWindow = 30;  // intervals

  // The interval between two beats that follow each other; leave out those that begin or end with a ventricular ectopic
  // beat or with noise.
  void push(Seconds rr) noexcept;
  void clear() noexcept;

  [[nodiscard]] Rhythm rhythm() const noexcept { return rhythm_; }

 private:
  std::array<double, kWindow> rr_s_{};  // oldest first
  std::array<double, kWindow> error_s_{};
  int count_ = 0;
  RrPredictor predictor_;
  Rhythm rhythm_ = Rhythm::kUnknown;
};

}  // namespace perimap
