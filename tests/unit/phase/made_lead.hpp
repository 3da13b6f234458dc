// ECG leads that are made of bell-shaped waves, with the times of their beats.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "core/phase/r_peak.hpp"

namespace perimap::test {

struct MadeLead {
  double rate_hz = 0.0;
  std::vector<float> mV;
  std::vector<double> beats_s;
};

// Amplitudes are to R, which is 1 mV.
struct MadeLeadSettings {
  double p = 0.1;
  double t = 0.2;
  double pr_s = 0.16;  // from the peak of P to that of R
  double qrs_s = 0.08;
  double p_sigma_s = 0.020;
  double per_minute = 75.0;  // P waves
  double sign = 1.0;
  double rate_hz = 360.0;
  double noise_mV = 0.0;  // white, beside 0.01 mV
  double jitter = 0.03;   // of the cycle, standard deviation
  bool block = false;     // every second P wave is not conducted
  bool atrial_spikes = false;
  bool ventricular_spikes = false;
  double duration_s = 60.0;
  std::uint64_t seed = 1;

  [[nodiscard]] std::string text() const;
};

[[nodiscard]] MadeLead make_lead(const MadeLeadSettings& settings);

struct MadeOutcome {
  static constexpr double kWrong = 0.7;  // a confidence above which a false beat is told without doubt

  int beats = 0;
  int missed = 0;
  int extra = 0;
  int wrong = 0;    // of the extra, told without doubt
  int doubted = 0;  // of all that were told

  [[nodiscard]] double f1_percent() const noexcept;
  // In more than one beat, and in more than two of a hundred.
  [[nodiscard]] bool confidently_wrong() const noexcept;
};
// What was told of a lead, one to one within 150 ms.
[[nodiscard]] MadeOutcome scored(const MadeLead& lead, const std::vector<RPeak>& told);

// P/R 0.1 to 1, T/R 0.2 to 2, PR 100 to 260 ms, QRS 60 to 180 ms, rate of the ventricles 28 to 240, either polarity,
// 100 to 1000 Hz, noise to 0.2 mV, 2:1 block, pacing; waves that do not fit in the cycle are drawn again.
[[nodiscard]] MadeLeadSettings draw_lead(std::mt19937_64& generator);

// Where the QRS can be told: P and T are below 1.2 R and it is the narrowest wave.
[[nodiscard]] bool is_plain(const MadeLeadSettings& settings) noexcept;

}  // namespace perimap::test
