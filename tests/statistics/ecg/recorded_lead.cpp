#include "recorded_lead.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "drivers/ecg_file/wfdb.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap::test {
namespace {

constexpr std::size_t kLargestTable = 10'000'000;
constexpr std::string_view kFlutter = "207";
constexpr double kFlutterFrom_s = 4.0;
constexpr double kEdge_s = 0.3;  // of a beat and what follows it

template <class T>
T or_throw(Expected<T> read) {
  if (!read) throw std::runtime_error(read.error().message);
  return *std::move(read);
}

EcgTrace read_i16(const std::filesystem::path& file) {
  constexpr double kRate_hz = 360.0;
  constexpr double kCountsPerMv = 200.0;
  const std::unique_ptr<gzFile_s, int (*)(gzFile)> in(gzopen(file.c_str(), "rb"), gzclose);
  if (!in) throw std::runtime_error(file.string() + ": expected a readable gzip file");
  EcgTrace trace;
  std::array<unsigned char, 65536> piece{};
  int count = 0;
  while ((count = gzread(in.get(), piece.data(), piece.size())) > 0) {
    for (std::size_t i = 0; i + 1 < static_cast<std::size_t>(count); i += 2) {
      const auto value = static_cast<std::int16_t>(piece[i] | (piece[i + 1] << 8));
      trace.time_s.push_back(static_cast<double>(trace.mV.size()) / kRate_hz);
      trace.mV.push_back(static_cast<float>(value / kCountsPerMv));
    }
  }
  if (count < 0) throw std::runtime_error(file.string() + ": damaged gzip data");
  return trace;
}

RecordedLead load(const std::filesystem::path& folder, const std::string& name, bool aside) {
  RecordedLead record;
  record.name = name;
  record.aside = aside;
  const std::filesystem::path header = folder / (name + ".hea");
  record.trace = std::filesystem::exists(header) ? or_throw(read_wfdb(header.string(), "")).trace
                                                 : read_i16(folder / (name + "_ch0_200perMV_360Hz.i16.gz"));
  const std::filesystem::path beats = folder / (name + "_beats.csv");
  record.beats =
      or_throw(parse_beat_table(or_throw(read_text_file(beats, kLargestTable, "table of beats")), beats.string()))
          .beats;
  if (record.trace.time_s.size() < 2) throw std::runtime_error(name + ": no samples");
  record.rate_hz = 1.0 / (record.trace.time_s[1] - record.trace.time_s[0]);
  return record;
}

}  // namespace

std::vector<RecordedLead> load_records(const std::filesystem::path& folder, const std::vector<std::string>& only) {
  std::istringstream parts(or_throw(read_text_file(PERIMAP_ECG_RECORDS, kLargestTable, "table of records")));
  std::vector<RecordedLead> records;
  std::string line;
  std::getline(parts, line);
  while (std::getline(parts, line)) {
    const std::string name = line.substr(0, line.find(','));
    if (!only.empty() && std::find(only.begin(), only.end(), name) == only.end()) continue;
    records.push_back(load(folder, name, line.find(",aside,") != std::string::npos));
  }
  if (records.empty()) throw std::runtime_error("none of the records that are named is known");
  return records;
}

std::vector<RecordedLead> part_of(const std::vector<RecordedLead>& records, bool aside, bool with_flutter) {
  std::vector<RecordedLead> part;
  for (const RecordedLead& record : records) {
    if (record.aside == aside && (with_flutter || record.name != kFlutter)) part.push_back(record);
  }
  return part;
}

RecordedLead stretch_of(const RecordedLead& record, double from_s, double length_s) {
  RecordedLead stretch{record.name, record.aside, {}, {}, record.rate_hz};
  const auto begin = static_cast<std::size_t>(from_s * record.rate_hz);
  const auto end = std::min(begin + static_cast<std::size_t>(length_s * record.rate_hz), record.trace.mV.size());
  const double begin_s = record.trace.time_s[begin];
  for (std::size_t i = begin; i < end; ++i) {
    stretch.trace.time_s.push_back(record.trace.time_s[i] - begin_s);
    stretch.trace.mV.push_back(record.trace.mV[i]);
  }
  for (ReferenceBeat beat : record.beats) {
    beat.time_s -= begin_s;
    if (beat.time_s >= 0.0 && beat.time_s < stretch.trace.time_s.back()) stretch.beats.push_back(std::move(beat));
  }
  return stretch;
}

EcgAnalysis analysed(const RecordedLead& record) {
  EcgAnalysis analysis = analyse(record.trace, [](std::size_t) { return true; });
  if (record.name != kFlutter || record.beats.empty()) return analysis;
  std::vector<std::pair<double, double>> flutters;
  for (std::size_t i = 0; i + 1 < record.beats.size(); ++i) {
    const double begin_s = record.beats[i].time_s;
    const double end_s = record.beats[i + 1].time_s;
    if (end_s - begin_s > kFlutterFrom_s) flutters.emplace_back(begin_s + kEdge_s, end_s - kEdge_s);
  }
  flutters.emplace_back(record.beats.back().time_s + kEdge_s, record.trace.time_s.back() + 1.0);
  std::erase_if(analysis.beats, [&](const AnalysedBeat& beat) {
    const double t = to_seconds(beat.peak.time.time_since_epoch());
    return std::any_of(flutters.begin(), flutters.end(),
                       [&](const auto& flutter) { return t > flutter.first && t < flutter.second; });
  });
  return analysis;
}

}  // namespace perimap::test
