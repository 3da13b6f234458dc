#include "drivers/standins/emulator/sampled_waveform.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "drivers/standins/simulator/ecg_record.hpp"
#include "drivers/standins/truth/heart_motion.hpp"

namespace perimap {
namespace {

constexpr float kOff = std::numeric_limits<float>::quiet_NaN();
constexpr int kPeriodsMissing = 3;  // from one sample to the next: some are missing

}  // namespace

SampledWaveform::SampledWaveform(Instant start, double sample_rate_hz, std::vector<float> values, bool repeated)
    : start_(start), longest_step_ns_(std::llround(kPeriodsMissing * 1e9 / sample_rate_hz)) {
  const auto time_ns = [&](std::size_t i) { return std::llround(static_cast<double>(i) * 1e9 / sample_rate_hz); };
  points_.reserve(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) points_.push_back({time_ns(i), values[i]});
  if (repeated) repeated_after_ns_ = time_ns(values.size());
}

void SampledWaveform::add(const Point& point) {
  // Stamps of a device are fitted as it goes, and may step back a little.
  if (points_.empty() || point.since_ns > points_.back().since_ns) points_.push_back(point);
}

SampledWaveform::SampledWaveform(std::span<const EcgBlock> blocks, Duration offset)
    : start_(blocks.front().first_sample_time + offset) {
  for (const EcgBlock& block : blocks) {
    longest_step_ns_ = std::max(longest_step_ns_, kPeriodsMissing * block.sample_period.count());
    for (std::uint32_t i = 0; i < block.count; ++i) {
      const Instant t = block.time_of(i) + offset;
      add({(t - start_).count(), block.lead_off ? kOff : block.mV[i]});
    }
  }
}

SampledWaveform SampledWaveform::second_lead(std::span<const EcgBlock> blocks, Duration offset) {
  std::vector<EcgBlock> second(blocks.begin(), blocks.end());
  for (EcgBlock& block : second) {
    block.mV = block.second_mV;
    block.lead_off = block.second_off || !block.has_second;
  }
  return {second, offset};
}

SampledWaveform SampledWaveform::seen_elsewhere(float times, Duration later) const {
  SampledWaveform seen = *this;
  seen.start_ += later;
  for (Point& point : seen.points_) point.value *= times;
  return seen;
}

SampledWaveform::SampledWaveform(std::span<const RespirationBlock> blocks, Duration offset)
    : start_(blocks.front().first_sample_time + offset) {
  float lowest = std::numeric_limits<float>::infinity();
  float highest = -lowest;
  for (const RespirationBlock& block : blocks) {
    longest_step_ns_ = std::max(longest_step_ns_, kPeriodsMissing * block.sample_period.count());
    for (std::uint32_t i = 0; i < block.count; ++i) {
      const Instant t = block.time_of(i) + offset;
      const bool off = block.sensor_off || !std::isfinite(block.values[i]);
      add({(t - start_).count(), off ? kOff : block.values[i]});
      if (off) continue;
      lowest = std::min(lowest, block.values[i]);
      highest = std::max(highest, block.values[i]);
    }
  }
  const float half = highest > lowest ? 0.5F * (highest - lowest) : 1.0F;
  for (Point& point : points_) point.value = (point.value - 0.5F * (highest + lowest)) / half;
}

Expected<SampledWaveform> SampledWaveform::ecg_of_record(std::string_view name, Instant start) {
  auto record = load_ecg_record(name);
  if (!record) return tl::unexpected(std::move(record.error()));
  std::vector<float> mV;
  mV.reserve(record->samples.size());
  for (std::size_t i = 0; i < record->samples.size(); ++i) mV.push_back(record->mV(i));
  return SampledWaveform(start, record->sample_rate_hz, std::move(mV), true);
}

SampledWaveform SampledWaveform::breathing(Duration period, Instant start) {
  constexpr std::size_t kSamples = 500;
  HeartMotion motion;
  motion.respiration_mm = Vector3d(1.0, 0.0, 0.0);
  motion.respiration_period = period;
  std::vector<float> values;
  for (std::size_t i = 0; i < kSamples; ++i) {
    const Duration since = static_cast<std::int64_t>(i) * period / static_cast<std::int64_t>(kSamples);
    values.push_back(static_cast<float>(2.0 * respiration_displacement(motion, Instant(since)).x() - 1.0));
  }
  return {start, kSamples / to_seconds(period), std::move(values), true};
}

std::optional<float> SampledWaveform::at(Instant t) const noexcept {
  std::int64_t since_ns = (t - start_).count();
  if (points_.empty() || since_ns < 0) return std::nullopt;
  if (repeated_after_ns_ > 0) {
    since_ns %= repeated_after_ns_;
  } else if (since_ns > points_.back().since_ns) {
    return std::nullopt;
  }
  const auto right = std::upper_bound(points_.begin(), points_.end(), since_ns,
                                      [](std::int64_t ns, const Point& point) { return ns < point.since_ns; });
  const Point& left = *(right - 1);  // the first is at the start
  const Point next = right != points_.end()   ? *right
                     : repeated_after_ns_ > 0 ? Point{repeated_after_ns_, points_.front().value}
                                              : left;
  // Before the test for a gap: the sample itself is there, whatever comes after it.
  if (since_ns == left.since_ns) return left.value;
  const std::int64_t step_ns = next.since_ns - left.since_ns;
  if (step_ns > longest_step_ns_) return kOff;
  const auto part = static_cast<float>(static_cast<double>(since_ns - left.since_ns) / static_cast<double>(step_ns));
  return (1.0F - part) * left.value + part * next.value;
}

}  // namespace perimap
