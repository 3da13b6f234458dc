// Ectopic beats in the rhythm: how long the pauses after them last, and whether they prevail.
//
// The autoregressive prediction learns from normal cycles alone and knows of no pauses. When the next premature beat
// comes is not predicted, not even in bigeminy: where the pattern stops, the error would be a third of a cycle.
#pragma once

#include <cstdint>

#include "core/phase/r_peak.hpp"
#include "core/phase/seconds.hpp"

namespace perimap {

// A length and how well it is known.
struct PredictedLength {
  Seconds length{0.0};
  Seconds deviation{0.0};
};

class EctopicRhythm {
 public:
  // The cycle that has just ended.
  void push(Seconds rr, BeatClass begin, BeatClass end) noexcept;

  // Of the cycle that begins with a premature beat, after one of `previous`; `normal` is what is predicted from cycles
  // between normal beats.
  [[nodiscard]] PredictedLength predict_pause(Seconds previous, Seconds normal) const noexcept;

  // Hardly a cycle of the last eight lay between normal beats.
  [[nodiscard]] bool prevails() const noexcept { return prevails_; }

 private:
  // Of the pauses: how many, and mean and variance, fading.
  int pauses_ = 0;
  double mean_s_ = 0.0;
  double variance_s2_ = 0.0;
  std::uint8_t taught_ = 0xFF;  // of the last eight, a bit a cycle
  bool prevails_ = false;
};

}  // namespace perimap
