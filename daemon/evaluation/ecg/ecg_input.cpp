#include "daemon/evaluation/ecg/ecg_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/phase/ecg_filter.hpp"
#include "core/statistics/upper_median.hpp"
#include "core/time/instant.hpp"
#include "drivers/ecg_file/ecg_csv.hpp"
#include "drivers/ecg_file/wfdb.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLargestTable = std::size_t{1} << 32;

Expected<std::string> read_whole(const std::string& file, std::string_view what) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (!error && size > kLargestTable) return fail(file + ": is too large");
  return read_text_file(file, error ? 0 : static_cast<std::size_t>(size), what);
}

// The ECG channel of a recording; samples while the lead was off have no value. What is whole of a damaged one is
// taken.
Expected<EcgInput> read_recorded(const std::string& file, double gain) {
  auto reader = RecordingReader::open(file, ReadMode::kWhole);
  if (!reader) return tl::unexpected(reader.error());
  const std::array wanted{channels::kEcgSamples};
  const auto selected = reader->select(wanted);
  EcgInput input;
  EcgTrace& trace = input.trace;
  std::optional<std::int64_t> begin_ns;
  std::size_t unusable = 0;  // blocks
  Error first_unusable;
  while (selected) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) break;
    const auto samples = reader->decode<perimap_EcgSamples>(**message);
    if (!samples) {
      if (unusable++ == 0) first_unusable = samples.error();
      continue;
    }
    const auto& block = **samples;
    if (!begin_ns) begin_ns = block.first_sample_time_ns;
    for (std::uint32_t i = 0; i < block.ecg_mV._length; ++i) {
      const double t = 1e-9 * static_cast<double>(block.first_sample_time_ns - *begin_ns) +
                       1e-9 * static_cast<double>(block.sample_period_ns) * i;
      if (!trace.time_s.empty() && t <= trace.time_s.back()) continue;  // sent twice
      const double mV = block.lead_off ? std::numeric_limits<double>::quiet_NaN()
                                       : gain * static_cast<double>(block.ecg_mV._buffer[i]);
      trace.time_s.push_back(t);
      trace.mV.push_back(static_cast<float>(mV));
    }
  }
  input.damage = reader->damage();
  if (unusable > 0) {
    input.damage.push_back({fmt::format("{} ECG blocks passed over, the first: {}", unusable, first_unusable.message)});
  }
  if (!trace.mV.empty()) return input;
  if (!input.damage.empty()) return fail(input.damage.front().message + "; nothing of its ECG is whole");
  if (!selected) return tl::unexpected(selected.error());
  return fail(file + ": there are no ECG samples in it");
}

std::filesystem::path wfdb_header(std::filesystem::path path) { return path.replace_extension(".hea"); }

bool is_wfdb(const std::filesystem::path& path) {
  std::error_code unknown;
  return path.extension() == ".hea" || path.extension() == ".dat" ||
         (path.extension().empty() && std::filesystem::exists(wfdb_header(path), unknown));
}

// The detector takes nothing at other rates.
Expected<void> check_rate(const EcgTrace& trace, const std::string& input) {
  constexpr std::size_t kEnough = 1000;
  std::vector<double> intervals_s;
  for (std::size_t i = 1; i < std::min(trace.time_s.size(), kEnough); ++i) {
    intervals_s.push_back(trace.time_s[i] - trace.time_s[i - 1]);
  }
  if (intervals_s.empty()) return {};
  const double period_s = upper_median(intervals_s.begin(), intervals_s.end());
  if (period_s >= to_seconds(EcgFilter::kShortestPeriod) && period_s <= to_seconds(EcgFilter::kLongestPeriod)) {
    return {};
  }
  return fail(fmt::format("{}: {:.4g} samples a second; from 100 to 1000 are taken", input, 1 / period_s));
}

Expected<EcgInput> read_record(const EcgFile& file) {
  const std::string wanted = file.column ? std::to_string(*file.column) : file.signal;
  auto record = read_wfdb(wfdb_header(file.path), wanted);
  if (!record) return tl::unexpected(record.error());
  EcgInput input;
  input.trace = std::move(record->trace);
  for (float& mV : input.trace.mV) mV *= static_cast<float>(file.gain);
  input.signal = EcgLead{record->signal, std::move(record->description)};
  return input;
}

Expected<EcgInput> read_table(const EcgFile& file) {
  const auto text = read_whole(file.path, "ECG table");
  if (!text) return tl::unexpected(text.error());
  auto trace = parse_ecg_csv(*text, file.path, {file.rate_hz, file.column, file.gain});
  if (!trace) return tl::unexpected(trace.error());
  EcgInput input;
  input.trace = *std::move(trace);
  return input;
}

Expected<EcgInput> read_file(const EcgFile& file) {
  if (std::filesystem::path(file.path).extension() == ".mcap") return read_recorded(file.path, file.gain);
  return is_wfdb(file.path) ? read_record(file) : read_table(file);
}

}  // namespace

std::string misfit(const EcgFile& file) {
  if (!std::isfinite(file.gain) || file.gain == 0.0) return "--gain must be a number other than 0";
  const std::filesystem::path path(file.path);
  if (path.extension() == ".mcap" && (file.rate_hz || file.column)) {
    return "a recording knows its rate and channel: leave out --rate and --column";
  }
  if (is_wfdb(path) && file.rate_hz) return "a WFDB record knows its rate: leave out --rate";
  if (!is_wfdb(path) && !file.signal.empty()) return "--signal chooses of a WFDB record; a table has --column";
  if (file.column && !file.signal.empty()) return "--signal and --column say the same: leave out one";
  return {};
}

std::vector<std::filesystem::path> files_of(const EcgFile& file) {
  const std::filesystem::path path(file.path);
  if (!is_wfdb(path)) return {};
  auto record = wfdb_files(wfdb_header(path));
  record.push_back(std::filesystem::path(path).replace_extension(".dat"));
  return record;
}

Expected<EcgInput> read_ecg(const EcgFile& file) {
  auto input = read_file(file);
  if (!input) return input;
  if (auto fits = check_rate(input->trace, file.path); !fits) return tl::unexpected(fits.error());
  if (!input->damage.empty()) {
    input->whole_until = fmt::format("{}: is damaged: what is whole of its ECG ends {:.3f} s after its first sample",
                                     file.path, input->trace.time_s.back());
  }
  return input;
}

Expected<BeatTable> read_beats(const std::string& file) {
  const auto text = read_whole(file, "table of reference beats");
  if (!text) return tl::unexpected(text.error());
  return parse_beat_table(*text, file);
}

}  // namespace perimap
