// How far the ends of cycles that the images foretell are to be trusted over those that the rhythm predicts.
//
// In the middle of a cycle the images have shown how fast its phase runs, and so when it will end. Where the heart does
// not move quite as the law says, that is read with a lever: a heart at 122 beats a minute whose systole follows the
// cycle before, taken for even, foretells ends that are several milliseconds off, worse than an even rhythm does. The R
// peaks tell: this is the slope of their regression on what was foretold, both from the ECG's prediction, in seconds.
//
// How far a cycle has been seen is told by the length sensitivity of the phase seen last (CyclePhase): the lever that
// remains is (1 - sensitivity) to sensitivity, under any law.
//
// No heap, no locks.
#pragma once

#include <chrono>

#include "core/time/instant.hpp"

namespace perimap {

// The end of a cycle, foretold by the images.
struct ForetoldEnd {
  Instant predicted;      // by the ECG alone
  Duration deviation{0};  // of that prediction, > 0
  Duration moved{0};      // by so much later the images have it
};

class EndTrust {
 public:
  // Where an end is foretold that counts: with no lever yet beyond 1, and with one that still matters.
  static constexpr double kLeastSensitivity = 0.5;
  static constexpr double kMostSensitivity = 0.85;

  // The first that is foretold of a cycle counts.
  void foretell(const ForetoldEnd& end, double sensitivity) noexcept;
  [[nodiscard]] bool foretold() const noexcept { return foretold_; }
  // The R peak that ended the cycle: what was foretold of it is learnt from.
  void score(Instant r_peak) noexcept;
  // What was foretold comes to nothing.
  void discard() noexcept { foretold_ = false; }

  // By which share of what the images moved the end it is to be moved: (0, 1]. The more, the farther the cycle has been
  // seen, and the less the ECG's prediction, of that variance, knows.
  [[nodiscard]] double weight(double sensitivity, double predicted_variance_s2) const noexcept;

 private:
  ForetoldEnd end_;
  bool foretold_ = false;
  // Sums that fade.
  double scored_ = 0.0;
  double deviation_square_s2_ = 0.0;
  double moved_square_s2_ = 0.0;
  double product_s2_ = 0.0;
  double slope_ = 1.0;
};

}  // namespace perimap
