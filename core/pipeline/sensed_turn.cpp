#include "core/pipeline/sensed_turn.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/angle/angle.hpp"

namespace perimap {
namespace {

PoseHistorySettings of_sensors(PoseHistorySettings settings) noexcept {
  settings.X_SC = Pose{};
  return settings;
}

constexpr Duration kWindow = std::chrono::milliseconds(100);
// The windows of frames overlap.
constexpr double kCommonShare = 0.5;

}  // namespace

SensedTurn::SensedTurn(const TurnedScope& scope, const CameraModel& lens, const PoseHistorySettings& tracker)
    : settings_(tracker),
      states_(scope, lens),
      sensor_(of_sensors(tracker)),
      second_(of_sensors(tracker)),
      held_(kCommonShare) {}

void SensedTurn::Sensor::add(const TrackerSample& sample) noexcept {
  const bool valid = sample.state == ToolState::kOk;
  repeats.add(valid && last && last->t == sample.X_WS.t && last->R == sample.X_WS.R, sample.arrival);
  last = valid ? std::optional(sample.X_WS) : std::nullopt;
  static_cast<void>(poses.add(sample));
}

void SensedTurn::add(const TrackerSample& sensor) noexcept { sensor_.add(sensor); }

void SensedTurn::add_second(const TrackerSample& second) noexcept {
  second_.add(second);
  times_[count_++ % kTimes] = second.source_time + settings_.time_offset;
}

// Where both keep still to the last bit nothing is wrong that the frames themselves do not tell.
bool SensedTurn::stuck() const noexcept { return second_.repeats.long_enough() && !sensor_.repeats.long_enough(); }

std::optional<Instant> SensedTurn::take_stuck_since() noexcept {
  const bool news = stuck() && !stuck_told_;
  stuck_told_ = stuck();
  return news ? std::optional(second_.repeats.since()) : std::nullopt;
}

std::optional<SensedTurn::Reading> SensedTurn::read(Instant capture) const noexcept {
  const CameraPose sensor_now = sensor_.poses.at(capture);
  const CameraPose second_now = second_.poses.at(capture);
  if (!sensor_now.valid() || !second_now.valid() || stuck()) return std::nullopt;
  // About what it is now, so that small turns are averaged.
  const Matrix3d now_S2 = sensor_now.X_WC.R.transpose() * second_now.X_WC.R;
  struct Half {
    Vector3d sum = Vector3d::Zero();
    double readings = 0.0;
  } older, newer;
  double variance_rad2 = 0.0;
  for (std::uint64_t i = count_; i > 0 && count_ - i < kTimes; --i) {
    const Instant t = times_[(i - 1) % kTimes];
    if (t > capture) continue;
    if (t < capture - kWindow) break;
    const CameraPose sensor = sensor_.poses.at(t);
    const CameraPose second = second_.poses.at(t);
    if (!sensor.valid() || !second.valid()) continue;
    Half& half = t > capture - kWindow / 2 ? newer : older;
    half.sum += so3_log(now_S2.transpose() * sensor.X_WC.R.transpose() * second.X_WC.R);
    half.readings += 1.0;
    variance_rad2 += sensor.rotation_variance_rad2 + second.rotation_variance_rad2;
  }
  const double readings = older.readings + newer.readings;
  if (readings == 0.0) return std::nullopt;
  variance_rad2 /= readings;
  const Matrix3d R_S2 = now_S2 * so3_exp((older.sum + newer.sum) / readings);
  // What of an error outlasts the window frames have in common; what does not is averaged as far as it is new.
  const double lasts_s = to_seconds(settings_.error_correlation);
  const double common = lasts_s > 0.0 ? std::exp(-to_seconds(kWindow) / lasts_s) : 0.0;
  const double independent = std::max(1.0, readings / (1.0 + 2.0 * readings * lasts_s / to_seconds(kWindow)));
  const double own_variance_rad2 = (1.0 - common) * variance_rad2 / independent;
  const SecondSensor& calibrated = *states_.scope().second_sensor;
  constexpr double kSlipped_rad = 2.0 * kDegree;
  constexpr double kDeviations = 5.0;
  const double deviation_rad = std::sqrt(own_variance_rad2 + common * variance_rad2);
  if (!(calibrated.aside_rad(R_S2) <= kSlipped_rad + kDeviations * deviation_rad)) return std::nullopt;
  // While the scope is turned, the window's middle is behind the frame by what its halves are apart.
  double lag_rad2 = 0.0;
  if (older.readings > 0.0 && newer.readings > 0.0) {
    const Vector3d apart = newer.sum / newer.readings - older.sum / older.readings;
    const double along_rad = apart.dot(R_S2.transpose() * states_.scope().axis_S);
    const double of_noise_rad2 = variance_rad2 * (1.0 / older.readings + 1.0 / newer.readings);
    lag_rad2 = std::max(0.0, along_rad * along_rad - of_noise_rad2);
  }
  return Reading{{calibrated.rotation_rad(R_S2), std::sqrt(own_variance_rad2)}, common * variance_rad2 + lag_rad2};
}

std::optional<ScopeState> SensedTurn::at(Instant capture) noexcept {
  const auto reading = read(capture);
  if (!reading) return std::nullopt;
  auto held = held_.hold(reading->own);
  if (!held) return std::nullopt;
  held->deviation_rad = std::sqrt(held->deviation_rad * held->deviation_rad + reading->lasting_variance_rad2);
  return states_.at(*held, 0.0);
}

}  // namespace perimap
