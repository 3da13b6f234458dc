// A signal that an emulated device measures.
#pragma once

#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/sensors/ecg_block.hpp"
#include "core/sensors/respiration_block.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Samples from an instant on, interpolated linearly between them. Not a number: the electrode, or the sensor, is off.
class SampledWaveform {
 public:
  // At an even rate, once or again and again.
  SampledWaveform(Instant start, double sample_rate_hz, std::vector<float> values, bool repeated);
  // As recorded, `offset` later than then. What is missing between two blocks is as if the electrode were off. At least
  // one block.
  SampledWaveform(std::span<const EcgBlock> blocks, Duration offset);
  // Likewise, the second lead of these blocks.
  [[nodiscard]] static SampledWaveform second_lead(std::span<const EcgBlock> blocks, Duration offset);
  // Likewise; the values from -1 to 1, whatever they were.
  SampledWaveform(std::span<const RespirationBlock> blocks, Duration offset);

  // The ECG of one of the records that the simulator carries, in mV, repeated for ever.
  [[nodiscard]] static Expected<SampledWaveform> ecg_of_record(std::string_view name, Instant start);
  // One breath as the simulator has it, from -1 to 1, repeated for ever.
  [[nodiscard]] static SampledWaveform breathing(Duration period, Instant start);

  // As another lead might see it: so many times as large, and later.
  [[nodiscard]] SampledWaveform seen_elsewhere(float times, Duration later) const;

  [[nodiscard]] Instant start() const noexcept { return start_; }
  // None before the beginning and after the end.
  [[nodiscard]] std::optional<float> at(Instant t) const noexcept;

 private:
  struct Point {
    std::int64_t since_ns;  // the start
    float value;
  };

  explicit SampledWaveform(Instant start) : start_(start) {}
  void add(const Point& point);

  Instant start_;
  std::vector<Point> points_;           // in order of time
  std::int64_t longest_step_ns_ = 0;    // between two samples that follow each other
  std::int64_t repeated_after_ns_ = 0;  // 0: never
};

}  // namespace perimap
