#include "core/phase/ecg_filter.hpp"

#include <algorithm>
#include <cmath>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr Duration kSpike = milliseconds(4);           // a pacing spike behind a monitor's own filter
constexpr Duration kDespikedPeriod = milliseconds(5);  // slower signals are left as they are
constexpr Duration kSmooth = milliseconds(20);         // a whole period of 50 Hz
constexpr Duration kEnergy = milliseconds(80);         // about a normal QRS complex

}  // namespace

void EcgFilter::restart(Duration sample_period) noexcept {
  now_ = -1;
  period_ = sample_period;
  if (period_ < kShortestPeriod || period_ > kLongestPeriod) return;
  spike_half_ = period_ < kDespikedPeriod ? static_cast<int>((kSpike + period_ - Duration(1)) / period_) : 0;
  spike_half_ = std::min(spike_half_, kMaxSpikeHalf);
  smooth_width_ = samples_in(kSmooth);
  energy_width_ = samples_in(kEnergy);
}

int EcgFilter::samples_in(Duration d) const noexcept {
  return std::max(1, static_cast<int>((d + period_ / 2) / period_));
}

// Sums are formed anew each time: they are short, and a running sum would leave rounding errors that look like a
// signal on a flat line.
void EcgFilter::push(Instant t, double mV) noexcept {
  ++now_;
  EcgSample& sample = samples_[static_cast<std::size_t>(now_ & (kHistory - 1))];
  sample = EcgSample{};
  sample.time = t;
  sample.mV = mV;
  std::array<double, 2 * kMaxSpikeHalf + 1> around{};
  const int width = 2 * spike_half_ + 1;
  for (int k = 0; k < width; ++k) around[static_cast<std::size_t>(k)] = at(now_ - k).mV;
  sample.despiked = upper_median(around.begin(), around.begin() + width);
  const auto mean = [&](int over, auto&& of) {
    double sum = 0.0;
    for (int k = 0; k < over; ++k) sum += of(at(now_ - k));
    return sum / over;
  };
  sample.smooth = mean(smooth_width_, [](const EcgSample& s) { return s.despiked; });
  sample.smoother = mean(smooth_width_, [](const EcgSample& s) { return s.smooth; });
  sample.slope = sample.smoother - at(now_ - smooth_width_).smoother;
  sample.residue = std::abs(at(now_ - spike_half_ - smooth_width_ / 2).mV - sample.smooth);
  sample.rough = mean(energy_width_, [](const EcgSample& s) { return s.residue; });
  sample.energy = mean(energy_width_, [](const EcgSample& s) { return std::abs(s.slope); });
}

}  // namespace perimap
