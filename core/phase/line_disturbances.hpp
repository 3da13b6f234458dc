// What disturbs the line: what came of late that is no heart's, and the noise that is always there.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/phase/beat_levels.hpp"
#include "core/phase/ecg_levels.hpp"
#include "core/phase/qrs_candidate.hpp"
#include "core/phase/r_peak_detector_settings.hpp"

namespace perimap {

class LineDisturbances {
 public:
  LineDisturbances(const DecisionSettings& settings, const EcgLevels& levels) noexcept
      : settings_(settings), levels_(levels) {}

  // One was seen at `t`, which counts as `weight` of one.
  void note(Instant t, double weight) noexcept;
  // They are over; when the last one came is still known.
  void clear() noexcept { count_ = 0.0; }

  // How many, fading since they came, but for steady noise.
  [[nodiscard]] double at(Instant t) const noexcept;
  [[nodiscard]] Instant last_at() const noexcept { return last_at_; }
  // The line goes to another level, or what is too fast for a heart is nearly as large: an electrode that moves, arcs.
  [[nodiscard]] bool unlike_any_beat(const QrsCandidate& candidate) const noexcept;

  // From bare noise of that level.
  [[nodiscard]] bool stands_out(const QrsCandidate& candidate, double noise) const noexcept {
    return candidate.energy >= std::exp(settings_.stand_out) * noise;
  }
  // Of the noise that is always there, 0 to 1, and whether that comes near to the beats.
  [[nodiscard]] double noisiness(const BeatLevels& beats) const noexcept {
    return beats.noisiness(levels_.noise(), settings_);
  }
  [[nodiscard]] bool near_to_beats(const BeatLevels& beats) const noexcept {
    return noisiness(beats) > settings_.near_to_beats;
  }
  // As how many disturbances it counts for what is like no kind.
  [[nodiscard]] double steady(const BeatLevels& beats) const noexcept {
    return near_to_beats(beats) ? settings_.most_disturbances * noisiness(beats) : 0.0;
  }

 private:
  const DecisionSettings& settings_;
  const EcgLevels& levels_;
  double count_ = 0.0;
  Instant last_at_;
};

}  // namespace perimap
