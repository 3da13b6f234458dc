// Records of the MIT-BIH Arrhythmia Database from a folder of the reader's own: the project does not carry them all.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/evaluation/ecg/ecg_analysis.hpp"
#include "drivers/ecg_file/beat_table.hpp"
#include "drivers/ecg_file/ecg_trace.hpp"

namespace perimap::test {

struct RecordedLead {
  std::string name;
  bool aside = false;  // no constant is chosen by it (tests/statistics/ecg_records.csv)
  EcgTrace trace;      // evenly sampled from time 0
  std::vector<ReferenceBeat> beats;
  double rate_hz = 0.0;
};

// The records of ecg_records.csv, or those of `only`. For each NNN the folder holds NNN.hea and what that names, as
// PhysioNet has them, or NNN_ch0_200perMV_360Hz.i16.gz, the first signal alone; and NNN_beats.csv, a table of
// time_s,symbol, as `rdann -r NNN -a atr | awk 'BEGIN{print "time_s,symbol"} {print $2/360 "," $3}'` writes it. What
// cannot be read is thrown as a std::runtime_error that names the file.
[[nodiscard]] std::vector<RecordedLead> load_records(const std::filesystem::path& folder,
                                                     const std::vector<std::string>& only);

// Those of one part; `with_flutter`: 207 as well, whose ventricular flutter has no beats in the reference.
[[nodiscard]] std::vector<RecordedLead> part_of(const std::vector<RecordedLead>& records, bool aside,
                                                bool with_flutter);

// From `from_s` on, for so long.
[[nodiscard]] RecordedLead stretch_of(const RecordedLead& record, double from_s, double length_s);

// Beats and analysis outside of the stretches without reference beats, where that is a flutter: gaps of more than 4 s
// of record 207.
[[nodiscard]] EcgAnalysis analysed(const RecordedLead& record);

}  // namespace perimap::test
