#include "core/phase/beat_levels.hpp"

#include <algorithm>
#include <cmath>

namespace perimap {
namespace {

constexpr double kNoisy = 0.5;  // of a beat's energy: where bare noise comes up to it a shape tells less, a size more

}  // namespace

void BeatLevels::learn(const QrsCandidate& beat) noexcept {
  energy_.push(beat.energy);
  sharpness_.push(beat.sharpness);
  slope_.push(beat.slope);
}

void BeatLevels::turn(const QrsCandidate& beat, const DecisionSettings& settings) noexcept {
  const bool known = polarity().known;
  const double keep = known ? 1.0 - 1.0 / settings.polarity_memory : 0.0;
  const double hysteresis = known ? settings.polarity_hysteresis : 1.0;
  upward_ = keep * upward_ + (1.0 - keep) * beat.upward;
  downward_ = keep * downward_ + (1.0 - keep) * beat.downward;
  if (points_up_ ? downward_ > hysteresis * upward_ : upward_ >= hysteresis * downward_) points_up_ = !points_up_;
}

void BeatLevels::forget_size() noexcept {
  energy_.clear();
  sharpness_.clear();
  slope_.clear();
}

void BeatLevels::clear() noexcept {
  forget_size();
  upward_ = 0.0;
  downward_ = 0.0;
  points_up_ = true;
}

double BeatLevels::size(const QrsCandidate& candidate) const noexcept {
  if (!known()) return 1.0;
  return std::sqrt(candidate.energy / energy() * candidate.sharpness / sharpness());
}

double BeatLevels::noisiness(double noise, const DecisionSettings& settings) const noexcept {
  if (!known()) return 0.0;
  const double to_beat = std::exp(settings.stand_out) * noise / (kNoisy * energy());
  return std::min(to_beat * to_beat, 1.0);
}

}  // namespace perimap
