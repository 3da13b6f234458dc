// The ECG as the beat detector sees it: without pacing spikes and mains hum, as slope, and as the slope's energy.
//
// All filters are causal averages of a fixed duration, so that they do the same at every sample rate. The despiking
// median removes what is narrower than 4 ms. At 200 Hz and below, where it would take the tip of a QRS complex as well,
// a sample is removed that stands out from its neighbours by several times what they differ. Averages over 20 ms take
// out 50 Hz mains, and 60 Hz by 30 dB.
#pragma once

#include <array>
#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

struct EcgSample {
  Instant time;
  bool made_up = false;  // it was missing
  double mV = 0.0;
  double despiked = 0.0;   // without spikes
  double smooth = 0.0;     // mean of that over 20 ms
  double smoother = 0.0;   // mean of that over 20 ms
  double residue = 0.0;    // |mV - smooth|
  double slope = 0.0;      // mV a 20 ms: difference of `smoother` over 20 ms
  double energy = 0.0;     // mean of |slope| over 80 ms
  double curvature = 0.0;  // mV a (20 ms)^2: difference of `slope` over 20 ms
  double sharpness = 0.0;  // mean of |curvature| over 80 ms: what is above 15 Hz, where P and T waves hardly reach
  double rough = 0.0;      // mV, mean of |mV - smooth| over 80 ms: what is too fast for a QRS complex
};

class EcgFilter {
 public:
  static constexpr int kHistory = 1024;  // samples, a power of two; 1 s at the highest rate
  static constexpr Duration kShortestPeriod = std::chrono::microseconds(950);  // 1000 Hz and some tolerance
  static constexpr Duration kLongestPeriod = std::chrono::microseconds(10500);

  // Forgets the signal. The next sample is the first; before it the signal is taken to have stood still.
  void restart(Duration sample_period) noexcept;
  void push(Instant t, double mV, bool made_up) noexcept;
  // What is known of the converter.
  void forget() noexcept { quantum_mV_ = 0.0; }

  // The smallest step between samples so far: the converter's resolution. 0 before there was one.
  [[nodiscard]] double quantum_mV() const noexcept { return quantum_mV_; }

  [[nodiscard]] std::int64_t now() const noexcept { return now_; }  // index of the newest sample, -1 before the first
  [[nodiscard]] const EcgSample& at(
      std::int64_t i) const noexcept {  // one of the last kHistory, or clamped to the first
    return samples_[static_cast<std::size_t>((i < 0 ? 0 : i) & (kHistory - 1))];
  }
  [[nodiscard]] Duration period() const noexcept { return period_; }
  [[nodiscard]] int samples_in(Duration d) const noexcept;  // rounded, at least 1

  // By how many samples each output is later than what it shows.
  [[nodiscard]] int despiked_delay() const noexcept { return spike_half_; }
  [[nodiscard]] int smooth_delay() const noexcept { return spike_half_ + smooth_width_ / 2; }
  [[nodiscard]] int slope_delay() const noexcept { return spike_half_ + (3 * smooth_width_ - 2) / 2; }
  [[nodiscard]] int energy_delay() const noexcept { return slope_delay() + (energy_width_ - 1) / 2; }
  [[nodiscard]] int sharpness_delay() const noexcept { return energy_delay() + smooth_width_ / 2; }
  [[nodiscard]] int energy_width() const noexcept { return energy_width_; }
  // All averages are of the signal alone, and no more of what was taken to be before it.
  [[nodiscard]] bool filled() const noexcept { return now_ >= spike_half_ + smooth_width_ + energy_width_; }

 private:
  static constexpr int kMaxSpikeHalf = 4;

  [[nodiscard]] double median_about(std::int64_t centre) const noexcept;
  [[nodiscard]] double unless_alone(std::int64_t centre) const noexcept;

  Duration period_{0};
  std::int64_t now_ = -1;
  int spike_half_ = 0;  // samples to each side that tell a spike
  bool slow_ = false;
  double quantum_mV_ = 0.0;
  int smooth_width_ = 1;
  int energy_width_ = 1;
  std::array<EcgSample, kHistory> samples_{};
};

}  // namespace perimap
