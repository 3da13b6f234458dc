#include "drivers/standins/emulator/pose_track.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/geometry/pose.hpp"

namespace perimap {
namespace {

// Of a period: readings farther apart have a gap between them, and a reading nearer to a frame is that frame's own.
constexpr double kGap = 1.5;
constexpr double kOwn = 1e-3;
constexpr Duration kLasting = std::chrono::hours(1);  // of motions that are made here

// The mean of the steps that are no gaps.
double rate_of(const std::vector<TrackerSample>& samples) {
  constexpr double kRateOfOne_hz = 100.0;
  if (samples.size() < 2) return kRateOfOne_hz;
  std::vector<double> steps;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    steps.push_back(to_seconds(samples[i].source_time - samples[i - 1].source_time));
  }
  std::vector<double> sorted = steps;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  double sum_s = 0.0;
  double count = 0.0;
  for (const double step : steps) {
    if (step > kGap * *middle) continue;
    sum_s += step;
    ++count;
  }
  return sum_s > 0.0 ? count / sum_s : kRateOfOne_hz;
}

}  // namespace

PoseTrack::PoseTrack(Instant start, double rate_hz, std::vector<Timed> readings)
    : start_(start), rate_hz_(rate_hz), readings_(std::move(readings)) {}

PoseTrack PoseTrack::of_samples(Instant start, const std::vector<TrackerSample>& samples) {
  std::vector<Timed> readings;
  readings.reserve(samples.size());
  for (const TrackerSample& sample : samples) {
    readings.push_back({sample.source_time - samples.front().source_time, {sample.state, sample.X_WS}});
  }
  return {start, rate_of(samples), std::move(readings)};
}

PoseTrack PoseTrack::swaying(Instant start, double rate_hz) {
  constexpr double kPeriod_s = 4.0;
  std::vector<Timed> readings;
  const auto count = static_cast<std::size_t>(to_seconds(kLasting) * rate_hz);
  readings.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    const double phase = 2.0 * std::numbers::pi * t / kPeriod_s;
    const Pose X_TO{so3_exp(Vector3d(0.1 * std::sin(phase), 0.05 * std::cos(phase), 0.0)),
                    Vector3d(20.0 * std::cos(phase), 20.0 * std::sin(phase), -500.0)};
    readings.push_back({from_seconds(t), {ToolState::kOk, X_TO}});
  }
  return {start, rate_hz, std::move(readings)};
}

PoseTrack PoseTrack::pivoting(Instant start, double rate_hz, const Vector3d& tip_O_mm) {
  constexpr double kSwing_rad = 0.5;
  constexpr double kPeriods_s[3] = {3.0, 4.1, 7.3};  // of the three axes: no two swing together
  const Vector3d tip_T_mm(50.0, 30.0, -500.0);
  std::vector<Timed> readings;
  const auto count = static_cast<std::size_t>(to_seconds(kLasting) * rate_hz);
  readings.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double t = static_cast<double>(i) / rate_hz;
    Vector3d turn;
    for (int axis = 0; axis < 3; ++axis)
      turn[axis] = kSwing_rad * std::sin(2.0 * std::numbers::pi * t / kPeriods_s[axis]);
    const Matrix3d R = so3_exp(turn);
    readings.push_back({from_seconds(t), {ToolState::kOk, {R, tip_T_mm - R * tip_O_mm}}});
  }
  return {start, rate_hz, std::move(readings)};
}

PoseTrack PoseTrack::still(Instant start, const Pose& X_TO) {
  constexpr double kRate_hz = 1.0;
  std::vector<Timed> readings;
  for (Duration t{0}; t <= kLasting; t += std::chrono::seconds(1)) readings.push_back({t, {ToolState::kOk, X_TO}});
  return {start, kRate_hz, std::move(readings)};
}

std::size_t PoseTrack::index_at(Duration since) const noexcept {
  const auto after = std::upper_bound(readings_.begin(), readings_.end(), since,
                                      [](Duration t, const Timed& reading) { return t < reading.since; });
  return after == readings_.begin() ? 0 : static_cast<std::size_t>(after - readings_.begin()) - 1;
}

ToolReading PoseTrack::at(std::int64_t frame) const noexcept {
  return reading_at(static_cast<double>(frame) * 1e9 / rate_hz_);
}

ToolReading PoseTrack::at(Duration since) const noexcept { return reading_at(static_cast<double>(since.count())); }

ToolReading PoseTrack::reading_at(double since_ns) const noexcept {
  const double period_ns = 1e9 / rate_hz_;
  if (readings_.empty()) return {};
  const std::size_t before = index_at(Duration(std::llround(since_ns)));
  const std::size_t after = std::min(before + 1, readings_.size() - 1);
  const auto time_ns = [this](std::size_t i) { return static_cast<double>(readings_[i].since.count()); };
  const auto distance = [&](std::size_t i) { return std::abs(since_ns - time_ns(i)) / period_ns; };
  const std::size_t nearest = distance(after) < distance(before) ? after : before;
  const ToolReading& r_0 = readings_[before].reading;
  const ToolReading& r_1 = readings_[after].reading;
  const double step_ns = time_ns(after) - time_ns(before);
  const bool between = since_ns > time_ns(before) && step_ns > 0.0 && step_ns <= kGap * period_ns &&
                       r_0.state == ToolState::kOk && r_1.state == ToolState::kOk;
  if (between && distance(nearest) > kOwn) {
    return {ToolState::kOk, interpolate(r_0.X_TO, r_1.X_TO, (since_ns - time_ns(before)) / step_ns)};
  }
  return distance(nearest) < 0.5 ? readings_[nearest].reading : ToolReading{};
}

}  // namespace perimap
