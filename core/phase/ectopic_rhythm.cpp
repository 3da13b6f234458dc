#include "core/phase/ectopic_rhythm.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace perimap {
namespace {

constexpr double kMemory = 6.0;           // pauses
constexpr int kEnough = 2;                // pauses from which on their mean is a guide
constexpr double kLeastDeviation = 0.05;  // of the length
constexpr double kUnseenDeviation = 0.2;  // likewise, of a pause when too few were seen
constexpr double kLongestPause = 1.6;     // normal cycles
constexpr int kPrevailsBelow = 2;         // cycles of eight between normal beats
constexpr int kGoneFrom = 4;

}  // namespace

void EctopicRhythm::push(Seconds rr, BeatClass begin, BeatClass end) noexcept {
  if (begin == BeatClass::kPremature && end != BeatClass::kPremature) {
    const double weight = 1.0 / std::min<double>(++pauses_, kMemory);
    const double difference_s = rr.count() - mean_s_;
    mean_s_ += weight * difference_s;
    // The first says nothing of how they scatter.
    if (pauses_ > 1) variance_s2_ = (1.0 - weight) * (variance_s2_ + weight * difference_s * difference_s);
  }
  taught_ = static_cast<std::uint8_t>(taught_ << 1 | (cycle_teaches(begin, end) ? 1 : 0));
  const int taught = std::popcount(taught_);
  prevails_ = prevails_ ? taught < kGoneFrom : taught < kPrevailsBelow;
}

PredictedLength EctopicRhythm::predict_pause(Seconds previous, Seconds normal) const noexcept {
  if (pauses_ >= kEnough)
    return {Seconds(mean_s_), Seconds(std::max(std::sqrt(variance_s2_), kLeastDeviation * mean_s_))};
  // A full compensatory pause: the sinus node goes on undisturbed.
  return {std::clamp(2.0 * normal - previous, normal, kLongestPause * normal), kUnseenDeviation * normal};
}

}  // namespace perimap
