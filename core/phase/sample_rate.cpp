#include "core/phase/sample_rate.hpp"

#include <cmath>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr double kOneStep = 2.5;   // times the median: steps of 1 and 2 ms are one rate, rounded; longer ones are gaps
constexpr int kEnough = 5;         // of the blocks that are remembered, more than half
constexpr double kAnother = 0.05;  // a mean of sixteen steps that are rounded to 1 ms is off by that at 800 Hz

}  // namespace

void SampleRate::push(Instant t) noexcept {
  if (step_count_ >= 0) steps_s_[static_cast<std::size_t>(step_count_)] = to_seconds(t - newest_);
  newest_ = t;
  if (++step_count_ < kBlock) return;
  step_count_ = 0;
  auto sorted = steps_s_;
  const double median = upper_median(sorted.begin(), sorted.end());
  double sum = 0.0;
  int count = 0;
  for (const double step : steps_s_) {
    if (step > kOneStep * median) continue;
    sum += step;
    ++count;
  }
  blocks_s_.push(sum / count);
}

Duration SampleRate::period() const noexcept {
  return blocks_s_.count() == 0 ? Duration::zero() : from_seconds(blocks_s_.median());
}

bool SampleRate::contradicts(Duration used) const noexcept {
  return blocks_s_.count() >= kEnough && std::abs(blocks_s_.median() / to_seconds(used) - 1.0) > kAnother;
}

}  // namespace perimap
