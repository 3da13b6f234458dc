// Any bytes as a table of an ECG and of beats: an error of one line, or samples in order of time.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/ecg_file/beat_table.hpp"
#include "drivers/ecg_file/ecg_csv.hpp"
#include "tests/fuzz/one_line_error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const EcgCsvOptions& options : {EcgCsvOptions{}, EcgCsvOptions{.rate_hz = 250.0, .column = {}, .gain = 2.0},
                                       EcgCsvOptions{.rate_hz = 250.0, .column = 2, .gain = 1.0},
                                       EcgCsvOptions{.rate_hz = {}, .column = 3, .gain = 1.0}}) {
    const auto trace = parse_ecg_csv(text, "fuzz.csv", options);
    if (!fuzz::is_value(trace)) continue;
    if (trace->mV.empty() || trace->mV.size() != trace->time_s.size()) std::abort();
    for (std::size_t i = 1; i < trace->time_s.size(); ++i) {
      if (!(trace->time_s[i] > trace->time_s[i - 1])) std::abort();
    }
  }
  const auto table = parse_beat_table(text, "fuzz.csv");
  if (fuzz::is_value(table)) {
    if (table->beats.empty()) std::abort();
    for (std::size_t i = 1; i < table->beats.size(); ++i) {
      if (!(table->beats[i].time_s > table->beats[i - 1].time_s)) std::abort();
    }
  }
  return 0;
}
