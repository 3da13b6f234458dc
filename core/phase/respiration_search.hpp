// Finds breathing in a displacement that all of the surface has in common.
//
// The displacement is averaged over tenths of a second; the last half minute of it is fitted, by least squares, with a
// mean, a drift, what a map that is not good yet gets wrong in each cardiac cycle alike (three harmonics of the cardiac
// phase), and two harmonics of each candidate frequency; the best frequency is refined. Ventilators keep their period,
// and spontaneous breath keeps it well enough over some breaths. What a map in its first seconds tells may be so wrong
// that the rest tells more without it, so of the oldest seconds as many are left out as make the phase surest.
//
// No heap, no locks.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "core/time/instant.hpp"

namespace perimap {

inline constexpr int kBreathHarmonics = 2;

// Displacement by breathing (mm, frame W) = sum_k a_k cos(k psi) - b_k sin(k psi), k = 1, 2.
struct BreathWave {
  std::array<Eigen::Vector3d, kBreathHarmonics> a = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::array<Eigen::Vector3d, kBreathHarmonics> b = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};

  [[nodiscard]] Eigen::Vector3d at(double phase_rad) const noexcept;
  [[nodiscard]] Eigen::Vector3d slope_at(double phase_rad) const noexcept;  // mm/rad
  // RMS over a breath of |d displacement / d psi|, mm.
  [[nodiscard]] double slope_mm_per_rad() const noexcept;
  // RMS over a breath of the displacement's length, mm.
  [[nodiscard]] double rms_mm() const noexcept;
  // The same motion with its phase counted from where psi was `phase_rad`.
  [[nodiscard]] BreathWave shifted(double phase_rad) const noexcept;
};

// The phase of `wave` that looks most like that of `other` at 0: wave.shifted(it) is nearest to `other`.
[[nodiscard]] double alignment(const BreathWave& wave, const BreathWave& other) noexcept;

struct FoundBreath {
  Instant time;  // phase 0 of `wave`: the newest displacement
  double rate_rad_per_s = 0.0;
  double phase_variance_rad2 = 0.0;  // at `time`
  double covariance_rad2_per_s = 0.0;
  double rate_variance_rad2_per_s2 = 0.0;
  double explained = 0.0;  // share of the displacement's variance, all else left out
  BreathWave wave;

  // As much of the displacement as that, a motion of that size, its phase that well known.
  [[nodiscard]] bool reaches(double least_explained, double least_rms_mm, double largest_deviation_rad) const noexcept;
};

struct RespirationSearchSettings {
  Duration shortest_period = std::chrono::seconds(2);
  Duration longest_period = std::chrono::seconds(10);
  double breaths = 2.2;               // that must have been seen
  double explained = 0.8;             // least share
  double phase_deviation_rad = 0.12;  // largest, at the newest instant
  double rate_deviation = 0.01;       // largest, share of the rate
  double least_rms_mm = 0.3;          // of what is called breathing
  int seconds_left_out = 5;           // at most, of the oldest
};

class RespirationSearch {
 public:
  explicit RespirationSearch(const RespirationSearchSettings& settings = {}) noexcept : settings_(settings) {}

  // In order of time, once a frame where it is known (mm), with the cardiac phase of that frame.
  void add(Instant t, const Eigen::Vector3d& displacement_mm, double cardiac_phase_rad) noexcept;
  void clear() noexcept { count_ = 0; }

  // Some milliseconds' work: not for the critical path. False when there is no breathing to be seen yet; `found` then
  // tells of the best candidate, if any.
  [[nodiscard]] bool find(FoundBreath& found) const noexcept;
  // The same where the rate is known: two breaths are enough. (After one, a young map has taken part of it in.) What is
  // not known of the rate is not counted.
  [[nodiscard]] bool find_at(double rate_rad_per_s, FoundBreath& found) const noexcept;
  // How much of the displacement of the last breaths alone, so many as must have been seen, is a wave of that rate:
  // what a map that was young got wrong is not in them any more. Explains nothing where there is too little.
  [[nodiscard]] FoundBreath lately(double rate_rad_per_s) const noexcept;

 private:
  static constexpr int kBins = 300;
  static constexpr Duration kBin = std::chrono::milliseconds(100);

  static constexpr int kCardiacHarmonics = 3;
  static constexpr int kOther = 2 + 2 * kCardiacHarmonics;  // columns that are not breathing
  static constexpr std::uint64_t kLeastBins = 4 * (kOther + 2 * kBreathHarmonics);

  struct Bin {
    Instant begin;
    std::array<double, 2 * kCardiacHarmonics> cardiac_sum{};  // cosines, sines
    double time_sum_s = 0.0;                                  // since `begin`
    Eigen::Vector3d sum_mm = Eigen::Vector3d::Zero();
    int count = 0;
  };
  struct Fit;

  [[nodiscard]] const Bin& bin(std::uint64_t index) const noexcept {
    return bins_[static_cast<std::size_t>(index % kBins)];
  }
  [[nodiscard]] std::uint64_t oldest() const noexcept { return count_ > kBins ? count_ - kBins : 0; }
  // From the bin `first` on.
  [[nodiscard]] Fit fit(double rate_rad_per_s, std::uint64_t first) const noexcept;
  [[nodiscard]] double refine(double rate_rad_per_s, double width_rad_per_s, std::uint64_t first) const noexcept;
  // The deviations are those of a rate that was found, or zero of one that is known.
  [[nodiscard]] FoundBreath breath_at(double rate_rad_per_s, bool known, std::uint64_t first) const noexcept;
  // With as many of the oldest left out as make it surest, of so many breaths at least. A rate that is known has no
  // width to be refined in.
  [[nodiscard]] FoundBreath surest(double rate_rad_per_s, double width_rad_per_s, double breaths) const noexcept;
  [[nodiscard]] bool is_known(const FoundBreath& found) const noexcept;
  [[nodiscard]] double span_s(std::uint64_t first) const noexcept;

  RespirationSearchSettings settings_;
  std::array<Bin, kBins> bins_{};
  std::uint64_t count_ = 0;  // bins begun
};

}  // namespace perimap
