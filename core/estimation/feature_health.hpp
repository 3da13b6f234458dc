// What to do about a feature whose filter does not explain what it sees.
//
// Two statistics of its normalised innovations squared (NIS) are followed. A slow one, over accepted updates alone,
// tells drift: the motion changes little by little (amplitude, heart rate, posture), the filter with its small
// covariance lags behind. Then process noise is turned on by steps and, after a long calm, off by steps: 0 while
// consistent, because without drift noise of .01 mm/sqrt(s) doubles the error. So it must not take for drift what the
// errors of a few R peaks do to all matches of their cycles. A fast one, over all updates with refused ones counted as
// outliers, tells that something is wrong altogether (a jump, another point followed, a wrong phase). When that lasts,
// the covariance is inflated once, and when that does not help the feature is to be started anew.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

#include "core/estimation/innovation_monitor.hpp"
#include "core/time/frame_rate.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct FeatureHealthSettings {
  InnovationMonitorSettings fast;
  InnovationMonitorSettings slow = {
      .memory_updates = 150.0, .enough_updates = 100, .consistent_below = 1.25, .high_above = 1.6};
  // Random walk of each coefficient, divided by its harmonic's number (mm/sqrt(s)).
  std::array<double, 3> process_noise = {0.0, 0.01, 0.03};
  Duration before_more = std::chrono::seconds(5);       // process noise, after its last change
  Duration before_less = std::chrono::seconds(30);      // likewise
  double calm_below = 1.1;                              // mean NIS/2 of the slow statistic
  Duration before_inflation = std::chrono::seconds(2);  // with the fast statistic high; an instrument passes faster
  Duration after_inflation = std::chrono::seconds(2);   // the time that inflation gets to help
};

enum class HealthState : std::uint8_t {
  kUndecided,  // too few updates yet
  kConsistent,
  kDrifting,      // process noise is on
  kInconsistent,  // innovations are high; the covariance has been inflated
  kFailed         // inflation has not helped
};

enum class HealthAction : std::uint8_t { kNone, kInflate, kStartAnew };

// What kInflate asks for: diffusion of this deviation.
inline constexpr double kInflation_mm = 1.0;

class FeatureHealth {
 public:
  explicit FeatureHealth(const FeatureHealthSettings& settings = {}) noexcept;

  // After each update: its NIS, which counts only if it was accepted (one refused may have none), and the part of it
  // that is common to the cycle's updates, see InnovationMonitor. `rate`: of what is learnt from. The caller carries
  // the action out; kStartAnew comes once.
  [[nodiscard]] HealthAction add(double nis, bool accepted, double common = 0.0,
                                 const FrameRate& rate = FrameRate()) noexcept;
  // The updates to come are of another cardiac cycle.
  void begin_cycle() noexcept { slow_.begin_cycle(); }
  // After a new start.
  void reset() noexcept;

  [[nodiscard]] HealthState state() const noexcept;
  // Of each coefficient of the first harmonic and the mean, to be divided by the harmonic's number (mm/sqrt(s)).
  [[nodiscard]] double process_noise() const noexcept { return settings_.process_noise[level_]; }
  // Of all updates: what the filter's consistency is judged by.
  [[nodiscard]] const InnovationMonitor& monitor() const noexcept { return fast_; }

 private:
  void set_level(std::size_t level) noexcept;

  FeatureHealthSettings settings_;
  InnovationMonitor fast_;
  InnovationMonitor slow_;
  std::size_t level_ = 0;
  int since_change_ = 0;      // updates since the level last changed
  int high_in_a_row_ = 0;     // updates with the fast statistic high
  int since_inflation_ = -1;  // updates since the covariance was inflated; -1: it was not
  bool failed_ = false;
};

}  // namespace perimap
