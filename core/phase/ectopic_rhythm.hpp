// Ectopic beats as part of the rhythm: how long the cycles beside them last, and whether they prevail.
//
// A premature beat is followed by a pause, and in bigeminy it comes as regularly as the normal beat before it; the
// autoregressive prediction, which learns from normal cycles alone, knows of neither.
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
  void clear() noexcept { *this = EctopicRhythm(); }

  // Of the cycle that begins with a beat of this class, after a cycle of `previous`; `normal` is what is predicted from
  // cycles between normal beats.
  [[nodiscard]] PredictedLength predict(BeatClass begin, Seconds previous,
                                        const PredictedLength& normal) const noexcept;

  // Hardly a cycle of the last eight lay between normal beats.
  [[nodiscard]] bool prevails() const noexcept { return prevails_; }

 private:
  // Mean and mean square deviation, fading over some cycles.
  struct Fading {
    int count = 0;
    double mean_s = 0.0;
    double variance_s2 = 0.0;
    void add(double value_s) noexcept;
  };

  Fading coupling_;             // from a normal beat to a premature one
  Fading pause_;                // from a premature beat to the next
  int alternating_ = 0;         // cycles in a row that ended with the other class than the one before
  std::uint8_t taught_ = 0xFF;  // of the last eight, a bit a cycle
  bool prevails_ = false;
};

}  // namespace perimap
