// A real ECG record with its reference beats, from the data linked into the program.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/error/expected.hpp"

namespace perimap {

struct EcgRecord {
  static constexpr double kSampleRate_hz = 360.0;
  static constexpr double kCounts_per_mV = 200.0;

  std::string name;
  std::vector<std::int16_t> samples;        // counts
  std::vector<std::uint32_t> beat_samples;  // index of each R peak, ascending
};

// "100, 105, ...": what load_ecg_record takes.
[[nodiscard]] std::string ecg_record_names();

// The error names the record and what is wrong with it, or the names there are.
[[nodiscard]] Expected<EcgRecord> load_ecg_record(std::string_view name);

}  // namespace perimap
