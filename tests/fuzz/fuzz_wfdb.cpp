// Any bytes as a WFDB header, an empty line, and the samples of its signals.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/ecg_file/wfdb.hpp"
#include "tests/fuzz/one_line_error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace perimap;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t end = std::min(text.find("\n\n"), size);
  const auto header = parse_wfdb_header(text.substr(0, end), "fuzz.hea");
  if (!fuzz::is_value(header)) return 0;
  const std::size_t samples = std::min(end + 2, size);
  for (std::size_t i = 0; i < header->signals.size(); ++i) {
    const auto trace = decode_wfdb_signal(*header, i, {data + samples, size - samples}, "fuzz.dat");
    if (fuzz::is_value(trace) && (trace->mV.empty() || trace->mV.size() != trace->time_s.size())) std::abort();
  }
  return 0;
}
