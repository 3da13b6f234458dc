// The phase of breathing at any instant: a snapshot that can be copied between threads.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <type_traits>

#include "core/time/instant.hpp"

namespace perimap {

enum class RespirationState : std::uint8_t {
  kOff,        // not asked for: breathing is not part of the motion model
  kSearching,  // asked for, its period is not known (yet, or not any more)
  kLocked
};

// What tells the phase of breathing. The images correct what a channel tells.
enum class RespirationSource : std::uint8_t { kNone, kImage, kChannel };

// Breathing at one instant.
struct RespiratoryPhase {
  bool known = false;      // false: the rest but deviation_mm means nothing
  double phase_rad = 0.0;  // 2 pi a breath; where 0 lies is arbitrary, but the same while the source runs
  double rate_rad_per_s = 0.0;
  double deviation_mm = 0.0;  // per axis: what is not known of the displacement by breathing
};

class RespiratoryClock {
 public:
  RespirationState state = RespirationState::kOff;
  RespirationSource source = RespirationSource::kNone;  // none unless locked
  Instant time;                                         // of the phase and the rate below
  double phase_rad = 0.0;
  double rate_rad_per_s = 0.0;
  double phase_variance_rad2 = 0.0;
  double covariance_rad2_per_s = 0.0;  // of phase and rate
  double rate_variance_rad2_per_s2 = 0.0;
  double slope_mm_per_rad = 0.0;         // RMS over a breath and the axes of d displacement / d phase
  double unknown_displacement_mm = 0.0;  // per axis, while searching or suspected
  bool suspected = false;                // while off: the surface moves as by breathing
  bool corrected = false;                // the images have corrected it for half a breath, by a map that had learnt one

  // There is breathing, or may be, and its phase is not known.
  [[nodiscard]] bool unknown() const noexcept { return state == RespirationState::kSearching || suspected; }

  // What is displayed by it is not to be called good.
  [[nodiscard]] bool doubtful() const noexcept {
    return unknown() || (state == RespirationState::kLocked && !corrected);
  }

  [[nodiscard]] RespiratoryPhase at(Instant t) const noexcept {
    RespiratoryPhase phase;
    if (unknown()) phase.deviation_mm = unknown_displacement_mm;
    if (state != RespirationState::kLocked) return phase;
    const double dt = to_seconds(t - time);
    phase.known = true;
    phase.phase_rad = std::remainder(phase_rad + rate_rad_per_s * dt, 2.0 * std::numbers::pi);
    phase.rate_rad_per_s = rate_rad_per_s;
    const double variance = phase_variance_rad2 + dt * (2.0 * covariance_rad2_per_s + dt * rate_variance_rad2_per_s2);
    phase.deviation_mm = slope_mm_per_rad * std::sqrt(std::fmax(variance, 0.0));
    return phase;
  }
  // Of one breath; zero unless locked.
  [[nodiscard]] Duration period() const noexcept {
    return state == RespirationState::kLocked ? from_seconds(2.0 * std::numbers::pi / rate_rad_per_s) : Duration(0);
  }
};

static_assert(std::is_trivially_copyable_v<RespiratoryClock>);

}  // namespace perimap
