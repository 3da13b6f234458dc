#include "core/pipeline/pose_history.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace perimap {
namespace {

// What linear interpolation between readings 10 ms apart leaves of a hand's motion and tremor (0.1 mm at 10 Hz bends by
// 0.005 mm in 10 ms), with room for stamps that are off by a fraction of a millisecond.
constexpr double kInterpolationDeviation_mm = 0.02;
constexpr double kInterpolationDeviation_rad = 1e-4;
// How hard a hand can change the motion while nobody looks: the error of constant-velocity extrapolation is a t^2 / 2.
constexpr double kHandAcceleration_mm_per_s2 = 2000.0;
constexpr double kHandAcceleration_rad_per_s2 = 20.0;

constexpr double square(double x) noexcept { return x * x; }

}  // namespace

PoseHistory::Reading PoseHistory::reading_of(const TrackerSample& sample) const noexcept {
  Reading reading{sample.source_time + settings_.time_offset, sample.state == ToolState::kOk, sample.X_WS};
  const double error_mm = sample.error_mm / std::numbers::sqrt3;  // per axis
  // Written so that a value that is not a number changes nothing.
  if (!(error_mm > settings_.position_deviation_mm)) return reading;
  if (settings_.position_deviation_mm > 0.0) {
    reading.growth = error_mm / settings_.position_deviation_mm;
  } else {
    reading.own_mm = error_mm;
  }
  return reading;
}

bool PoseHistory::add(const TrackerSample& sample) noexcept {
  const Instant time = sample.source_time + settings_.time_offset;
  if (count_ > 0 && time <= reading(count_ - 1).time) return false;
  const bool valid = sample.state == ToolState::kOk;
  if (valid && !(sample.X_WS.R.allFinite() && sample.X_WS.t.allFinite())) return false;
  readings_[count_ % kCapacity] = reading_of(sample);
  ++count_;
  return true;
}

bool PoseHistory::reached(Instant t) const noexcept { return count_ > 0 && reading(count_ - 1).time >= t; }

CameraPose PoseHistory::between(const Reading& r_0, const Reading& r_1, Instant t,
                                CameraPose::State state) const noexcept {
  const double s = to_seconds(t - r_0.time) / to_seconds(r_1.time - r_0.time);
  const Pose X_WS = interpolate(r_0.X_WS, r_1.X_WS, s);
  CameraPose pose;
  pose.state = state;
  pose.X_WC = X_WS * settings_.X_SC;
  pose.lever_W_mm = X_WS.R * settings_.X_SC.t;
  // The pose is (1-s) r_0 + s r_1; where their errors are independent that has less than one reading's variance between
  // them, and more beyond.
  const double common = settings_.error_correlation > Duration(0)
                            ? std::exp(-to_seconds(r_1.time - r_0.time) / to_seconds(settings_.error_correlation))
                            : 0.0;
  const double weight = square(1.0 - s) + square(s) + 2.0 * common * s * (1.0 - s);
  // What a reading is farther off than usual is its own: nothing of it is common with the other, and it never makes the
  // pose better.
  const double excess = square(1.0 - s) * (square(r_0.growth) - 1.0) + square(s) * (square(r_1.growth) - 1.0);
  const double own_mm2 = square((1.0 - s) * r_0.own_mm) + square(s * r_1.own_mm);
  const double beyond_s = std::max(0.0, to_seconds(t - r_1.time));
  pose.own_position_variance_mm2 = excess * square(settings_.position_deviation_mm) + own_mm2 +
                                   square(kInterpolationDeviation_mm) +
                                   square(0.5 * kHandAcceleration_mm_per_s2 * square(beyond_s));
  pose.own_rotation_variance_rad2 = excess * square(settings_.rotation_deviation_rad) +
                                    square(kInterpolationDeviation_rad) +
                                    square(0.5 * kHandAcceleration_rad_per_s2 * square(beyond_s));
  pose.position_variance_mm2 = weight * square(settings_.position_deviation_mm) + pose.own_position_variance_mm2;
  pose.rotation_variance_rad2 = weight * square(settings_.rotation_deviation_rad) + pose.own_rotation_variance_rad2;
  return pose;
}

CameraPose PoseHistory::at(Instant t) const noexcept {
  if (count_ < 2) return {};
  const std::uint64_t oldest = count_ > kCapacity ? count_ - kCapacity : 0;
  const std::uint64_t newest = count_ - 1;
  if (t > reading(newest).time) {
    const Reading& r_1 = reading(newest);
    if (t - r_1.time > settings_.maximum_extrapolation || newest == oldest) return {};
    const Reading& r_0 = reading(newest - 1);
    if (!r_0.valid || !r_1.valid || r_1.time - r_0.time > settings_.maximum_gap) return {};
    return between(r_0, r_1, t, CameraPose::State::kExtrapolated);
  }
  // From the newest back: a capture lies a few readings in the past.
  for (std::uint64_t i = newest; i > oldest; --i) {
    const Reading& r_0 = reading(i - 1);
    if (t < r_0.time) continue;
    const Reading& r_1 = reading(i);
    if (!r_0.valid || !r_1.valid || r_1.time - r_0.time > settings_.maximum_gap) return {};
    return between(r_0, r_1, t, CameraPose::State::kInterpolated);
  }
  return {};
}

}  // namespace perimap
