#include "core/phase/ectopic_rhythm.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace perimap {
namespace {

constexpr double kMemory = 6.0;           // cycles
constexpr int kEnough = 2;                // cycles of a kind from which on their mean is a guide
constexpr double kLeastDeviation = 0.02;  // of the length
constexpr double kUnseenDeviation = 0.2;  // likewise, of a pause of which none was seen yet
constexpr double kLongestPause = 1.6;     // normal cycles
constexpr int kAlternates = 4;            // cycles from which on the next one is expected to go on so
constexpr double kMayStop = 0.2;          // of what it would make: that the alternation stops
constexpr int kPrevailsBelow = 2;         // cycles of eight between normal beats
constexpr int kGoneFrom = 4;

}  // namespace

void EctopicRhythm::Fading::add(double value_s) noexcept {
  ++count;
  const double weight = 1.0 / std::min<double>(count, kMemory);
  const double difference = value_s - mean_s;
  mean_s += weight * difference;
  // The first says nothing of how they scatter.
  if (count > 1) variance_s2 = (1.0 - weight) * (variance_s2 + weight * difference * difference);
}

void EctopicRhythm::push(Seconds rr, BeatClass begin, BeatClass end) noexcept {
  const bool from_premature = begin == BeatClass::kPremature;
  const bool to_premature = end == BeatClass::kPremature;
  if (from_premature && !to_premature) pause_.add(rr.count());
  if (!from_premature && to_premature) coupling_.add(rr.count());
  alternating_ = from_premature != to_premature ? alternating_ + 1 : 0;
  taught_ = static_cast<std::uint8_t>(taught_ << 1 | (cycle_teaches(begin, end) ? 1 : 0));
  const int taught = std::popcount(taught_);
  prevails_ = prevails_ ? taught < kGoneFrom : taught < kPrevailsBelow;
}

PredictedLength EctopicRhythm::predict(BeatClass begin, Seconds previous,
                                       const PredictedLength& normal) const noexcept {
  const auto seen = [](const Fading& cycles) {
    return PredictedLength{Seconds(cycles.mean_s),
                           Seconds(std::max(std::sqrt(cycles.variance_s2), kLeastDeviation * cycles.mean_s))};
  };
  if (begin == BeatClass::kPremature) {
    if (pause_.count >= kEnough) return seen(pause_);
    // A full compensatory pause: the sinus node goes on undisturbed.
    const Seconds full = 2.0 * normal.length - previous;
    return {std::clamp(full, normal.length, kLongestPause * normal.length), kUnseenDeviation * normal.length};
  }
  if (alternating_ < kAlternates || coupling_.count < kEnough) return normal;
  PredictedLength coupled = seen(coupling_);
  const double otherwise_s = std::abs((normal.length - coupled.length).count());
  coupled.deviation = Seconds(std::hypot(coupled.deviation.count(), kMayStop * otherwise_s));
  return coupled;
}

}  // namespace perimap
