#include "core/phase/ecg_filter.hpp"

#include <algorithm>
#include <cmath>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

using std::chrono::milliseconds;

constexpr Duration kSpike = milliseconds(4);  // a pacing spike behind a monitor's own filter
constexpr Duration kSlow = milliseconds(5);   // a median over three of these blunts a QRS complex
constexpr int kSlowHalf = 2;
constexpr double kAlone = 2.0;  // an R wave of 40 ms, at 100 Hz, stands out by 1.5 times what its neighbours differ
constexpr Duration kSmooth = milliseconds(20);  // a whole period of 50 Hz
constexpr Duration kEnergy = milliseconds(80);  // about a normal QRS complex

}  // namespace

void EcgFilter::restart(Duration sample_period) noexcept {
  now_ = -1;
  period_ = sample_period;
  if (period_ < kShortestPeriod || period_ > kLongestPeriod) return;
  slow_ = period_ >= kSlow;
  spike_half_ =
      slow_ ? kSlowHalf : std::min(static_cast<int>((kSpike + period_ - Duration(1)) / period_), kMaxSpikeHalf);
  smooth_width_ = samples_in(kSmooth);
  energy_width_ = samples_in(kEnergy);
}

// Half a sample is rounded upward, and what is one but for an error of the period.
int EcgFilter::samples_in(Duration d) const noexcept {
  return std::max(1, static_cast<int>((d + period_ / 2 + period_ / 50) / period_));
}

double EcgFilter::median_about(std::int64_t centre) const noexcept {
  std::array<double, 2 * kMaxSpikeHalf + 1> around{};
  const int width = 2 * spike_half_ + 1;
  for (int k = 0; k < width; ++k) around[static_cast<std::size_t>(k)] = at(centre - spike_half_ + k).mV;
  return upper_median(around.begin(), around.begin() + width);
}

// The sample, or the mean of those beside it where it is a spike.
double EcgFilter::unless_alone(std::int64_t centre) const noexcept {
  const double value = at(centre).mV;
  const double before = at(centre - 1).mV;
  const double after = at(centre + 1).mV;
  const auto [least, most] = std::minmax({at(centre - 2).mV, before, after, at(centre + 2).mV});
  const double outside = std::max({value - most, least - value, 0.0});
  return outside > kAlone * std::max(most - least, quantum_mV_) ? 0.5 * (before + after) : value;
}

// Sums are formed anew each time: they are short, and a running sum would leave rounding errors that look like a
// signal on a flat line.
void EcgFilter::push(Instant t, double mV, bool made_up) noexcept {
  ++now_;
  EcgSample& sample = samples_[static_cast<std::size_t>(now_ & (kHistory - 1))];
  sample = EcgSample{};
  sample.time = t;
  sample.made_up = made_up;
  sample.mV = mV;
  const EcgSample& last = at(now_ - 1);
  const double step = now_ > 0 && !made_up && !last.made_up ? std::abs(mV - last.mV) : 0.0;
  if (step > 0.0 && (quantum_mV_ == 0.0 || step < quantum_mV_)) quantum_mV_ = step;
  sample.despiked = slow_ ? unless_alone(now_ - spike_half_) : median_about(now_ - spike_half_);
  const auto mean = [&](int over, auto&& of) {
    double sum = 0.0;
    for (int k = 0; k < over; ++k) sum += of(at(now_ - k));
    return sum / over;
  };
  sample.smooth = mean(smooth_width_, [](const EcgSample& s) { return s.despiked; });
  sample.smoother = mean(smooth_width_, [](const EcgSample& s) { return s.smooth; });
  sample.slope = sample.smoother - at(now_ - smooth_width_).smoother;
  sample.curvature = sample.slope - at(now_ - smooth_width_).slope;
  sample.residue = std::abs(at(now_ - spike_half_ - smooth_width_ / 2).mV - sample.smooth);
  sample.rough = mean(energy_width_, [](const EcgSample& s) { return s.residue; });
  sample.energy = mean(energy_width_, [](const EcgSample& s) { return std::abs(s.slope); });
  sample.sharpness = mean(energy_width_, [](const EcgSample& s) { return std::abs(s.curvature); });
}

}  // namespace perimap
