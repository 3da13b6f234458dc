// ECG as a table: `time_s,mV` a line, or values alone at a known rate.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "drivers/ecg_file/ecg_trace.hpp"

namespace perimap {

struct EcgCsvOptions {
  std::optional<double> rate_hz;  // given: samples are evenly spaced, and no time column is needed
  std::optional<int> column;      // that holds the ECG, from 1; else the second, or the only one
  double gain = 1.0;              // mV a unit of that column
};

// Fields are separated by commas; empty lines and lines that begin with # are passed over. The first line may be a
// heading. An empty field or `nan` is a sample without value. Errors: "NAME:LINE:COLUMN: what is wrong".
[[nodiscard]] Expected<EcgTrace> parse_ecg_csv(std::string_view text, const std::string& name,
                                               const EcgCsvOptions& options);

}  // namespace perimap
