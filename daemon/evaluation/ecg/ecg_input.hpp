// An ECG from a file, whatever kind of file it is.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "drivers/ecg_file/beat_table.hpp"
#include "drivers/ecg_file/ecg_trace.hpp"

namespace perimap {

struct EcgFile {
  std::string path;               // a table, a WFDB record (.hea, .dat or its name) or a recording (.mcap)
  std::optional<double> rate_hz;  // of a table without times
  // One lead or two, the first first; none: not chosen.
  std::vector<int> columns;          // of a table, or signals of a WFDB record, from 1
  std::vector<std::string> signals;  // of a WFDB record: their names in the header, or their numbers from 1
  double gain = 1.0;                 // mV a unit
};

// Of a WFDB record, one that was read.
struct EcgLead {
  int number = 1;    // from 1
  std::string name;  // as the header calls it
};

struct EcgInput {
  EcgTrace trace;
  std::vector<Error> damage;  // what of the file could not be read
  std::string whole_until;    // a line that says until when a damaged one is whole; empty for others
  std::vector<EcgLead> signals;
};

// What of it does not go with this kind of file; empty when all does.
[[nodiscard]] std::string misfit(const EcgFile& file);
// The files that are read for it, beside the one that is named.
[[nodiscard]] std::vector<std::filesystem::path> files_of(const EcgFile& file);

// Of a recording both leads where it has two; of a damaged one what is whole. An error, too, at a rate that the
// detector does not take.
[[nodiscard]] Expected<EcgInput> read_ecg(const EcgFile& file);

// Reference beats.
[[nodiscard]] Expected<BeatTable> read_beats(const std::string& file);

}  // namespace perimap
