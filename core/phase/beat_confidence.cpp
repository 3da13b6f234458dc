#include "core/phase/beat_confidence.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

double size_difference(const BeatCircumstances& beat) noexcept { return std::abs(std::log(std::max(beat.gain, 1e-3))); }

}  // namespace

double suspicion(const BeatCircumstances& beat, const DecisionSettings& settings) noexcept {
  const double unlike = 1.0 - beat.correlation + settings.unlike_by_size * size_difference(beat);
  const double early = std::max(std::log(beat.usual_of_cycle / std::max(beat.of_cycle, 1e-3)) / beat.spread, 0.0);
  return unlike * (1.0 + early) * (1.0 + settings.unlike_in_noise * beat.disturbed);
}

// What is seen for the first time or in a burst may be anything, however much it looks like a beat.
double confidence(const BeatCircumstances& beat, const DecisionSettings& settings) noexcept {
  const bool another = beat.correlation < settings.very_familiar || size_difference(beat) > settings.same_gain;
  if (another && beat.disturbed > settings.much_noise && beat.of_cycle < settings.before_due) {
    return std::min(beat.probability, settings.early_in_noise);
  }
  if (beat.lost_in_noise) return std::min(beat.probability, settings.lost_in_noise);
  const bool young = !beat.long_known && beat.heard_for_long;
  const bool in_noise = !beat.long_known && beat.disturbed > settings.some_noise;
  const bool doubtful = young || in_noise || beat.in_steady_noise || beat.may_be_followed || beat.rivalled ||
                        beat.unlike_any_beat || (!beat.familiar && beat.any_known) ||
                        (beat.familiar && suspicion(beat, settings) > settings.suspicious);
  if (doubtful) return std::min(beat.probability, settings.doubtful);
  const bool calm = beat.disturbed <= settings.some_noise;
  return beat.long_known && calm ? 1.0 - std::pow(1.0 - beat.probability, settings.long_known_in_calm)
                                 : beat.probability;
}

}  // namespace perimap
