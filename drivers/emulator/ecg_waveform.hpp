// The ECG that an emulated device measures.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// Samples at an even rate from an instant on, once or again and again.
class EcgWaveform {
 public:
  EcgWaveform(Instant start, double sample_rate_hz, std::vector<float> mV, bool repeated)
      : start_(start), sample_rate_hz_(sample_rate_hz), mV_(std::move(mV)), repeated_(repeated) {}

  // One of the MIT-BIH records that the simulator carries, beginning at `start` and repeated for ever.
  [[nodiscard]] static Expected<EcgWaveform> of_record(std::string_view name, Instant start);

  [[nodiscard]] Instant start() const noexcept { return start_; }
  // Between its samples interpolated linearly; none before the beginning and after the end.
  [[nodiscard]] std::optional<float> at(Instant t) const noexcept;

 private:
  Instant start_;
  double sample_rate_hz_;
  std::vector<float> mV_;
  bool repeated_;
};

}  // namespace perimap
