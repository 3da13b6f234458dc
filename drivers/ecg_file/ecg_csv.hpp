// ECG as a table: `time_s,mV` a line, or values alone at a known rate.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/error/expected.hpp"
#include "drivers/ecg_file/ecg_trace.hpp"

namespace perimap {

struct EcgCsvOptions {
  std::optional<double> rate_hz;  // given: samples are evenly spaced from 0 s on, and times in the table are not read
  std::optional<int> column;      // that holds the ECG, from 1; else the second beside times, or the only one
  double gain = 1.0;              // mV a unit of that column
};

// Fields are separated by commas, semicolons, tabs or spaces, with decimal commas beside semicolons and tabs, and may
// be quoted; empty lines and lines that begin with # are passed over. The first line may be a heading, with units below
// it. Without a rate the first column holds the times in seconds. With one, a heading whose first name is a time
// (`is_time_name`) says that there are times to pass over; several columns without such a heading are an error unless
// `column` tells which is meant. An empty field, `nan`, `NA` and the like are a sample without value. Times may count
// from 1970. Errors: "NAME:LINE:COLUMN: what is wrong".
[[nodiscard]] Expected<EcgTrace> parse_ecg_csv(std::string_view written, const std::string& name,
                                               const EcgCsvOptions& options);

}  // namespace perimap
