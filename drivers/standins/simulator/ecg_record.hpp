// A real ECG record with its reference beats, from the data linked into the program.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct EcgRecord {
  std::string name;
  double sample_rate_hz = 0.0;
  double counts_per_mV = 0.0;
  std::vector<std::int16_t> samples;        // counts
  std::vector<std::uint32_t> beat_samples;  // index of each R peak, ascending

  [[nodiscard]] float mV(std::size_t sample) const { return static_cast<float>(samples[sample] / counts_per_mV); }
};

// "100, 105, ...": what load_ecg_record takes.
[[nodiscard]] std::string ecg_record_names();

// The error names the record and what is wrong with it, or the names there are.
[[nodiscard]] Expected<EcgRecord> load_ecg_record(std::string_view name);

}  // namespace perimap
