#include "daemon/evaluation/ecg/ecg_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

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

// The ECG channels of a recording, as one trace; samples while a lead was off have no value.
class RecordedLeads {
 public:
  RecordedLeads(double gain, bool two) : gain_(gain), two_(two) {}

  void second(const perimap_EcgSamples& block) {
    second_begin_ns_ = block.first_sample_time_ns;
    second_.assign(block.ecg_mV._buffer, block.ecg_mV._buffer + block.ecg_mV._length);
    if (block.lead_off) std::fill(second_.begin(), second_.end(), kNone);
  }
  void first(const perimap_EcgSamples& block) {
    if (!begin_ns_) begin_ns_ = block.first_sample_time_ns;
    const bool together = second_begin_ns_ == block.first_sample_time_ns && second_.size() == block.ecg_mV._length;
    for (std::uint32_t i = 0; i < block.ecg_mV._length; ++i) {
      const double t = 1e-9 * static_cast<double>(block.first_sample_time_ns - *begin_ns_) +
                       1e-9 * static_cast<double>(block.sample_period_ns) * i;
      if (!trace_.time_s.empty() && t <= trace_.time_s.back()) continue;  // sent twice
      trace_.time_s.push_back(t);
      trace_.mV.push_back(block.lead_off ? kNone : scaled(block.ecg_mV._buffer[i]));
      if (two_) trace_.second_mV.push_back(together ? scaled(second_[i]) : kNone);
    }
  }
  [[nodiscard]] EcgTrace take() { return std::move(trace_); }

 private:
  static constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

  [[nodiscard]] float scaled(float mV) const { return static_cast<float>(gain_ * static_cast<double>(mV)); }

  double gain_;
  bool two_;
  EcgTrace trace_;
  std::optional<std::int64_t> begin_ns_;
  std::optional<std::int64_t> second_begin_ns_;
  std::vector<float> second_;  // the last block
};

// What is whole of a damaged one is taken.
Expected<EcgInput> read_recorded(const std::string& file, double gain) {
  auto reader = RecordingReader::open(file, ReadMode::kWhole);
  if (!reader) return tl::unexpected(reader.error());
  const auto all = reader->channels();
  const bool two = std::any_of(all.begin(), all.end(),
                               [](const RecordedChannel& channel) { return channel.name == channels::kEcgSecondLead; });
  std::vector<std::string_view> wanted{channels::kEcgSamples};
  if (two) wanted.push_back(channels::kEcgSecondLead);
  const auto selected = reader->select(wanted);
  EcgInput input;
  RecordedLeads leads(gain, two);
  std::size_t unusable = 0;  // blocks
  Error first_unusable;
  while (selected) {
    const auto message = reader->next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) break;
    const auto samples = reader->decode<perimap_EcgSamples>(**message);
    if (!samples) {
      if (unusable++ == 0) first_unusable = samples.error();
    } else if ((*message)->channel == channels::kEcgSecondLead) {
      leads.second(**samples);
    } else {
      leads.first(**samples);
    }
  }
  input.trace = leads.take();
  input.damage = reader->damage();
  if (unusable > 0) {
    input.damage.push_back({fmt::format("{} ECG blocks passed over, the first: {}", unusable, first_unusable.message)});
  }
  if (!input.trace.mV.empty()) return input;
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

// Both leads must have been measured at the same instants.
Expected<void> join(EcgTrace& first, EcgTrace second, const std::string& file) {
  if (first.time_s != second.time_s) {
    return fail(fmt::format("{}: its two leads have no common times: one has {} samples, the other {}", file,
                            first.time_s.size(), second.time_s.size()));
  }
  first.second_mV = std::move(second.mV);
  return {};
}

// One option may name both, as "MLII,V5", unless that is a name itself.
std::vector<std::string> wanted_signals(const EcgFile& file) {
  std::vector<std::string> wanted = file.signals;
  for (const int column : file.columns) wanted.push_back(std::to_string(column));
  if (wanted.size() == 1 && wanted[0].find(',') != std::string::npos) {
    const std::size_t comma = wanted[0].find(',');
    wanted = {wanted[0].substr(0, comma), wanted[0].substr(comma + 1)};
  }
  if (wanted.empty()) wanted.emplace_back();
  return wanted;
}

Expected<EcgInput> read_record(const EcgFile& file) {
  EcgInput input;
  for (const std::string& wanted : wanted_signals(file)) {
    auto record = read_wfdb(wfdb_header(file.path), wanted);
    if (!record) return tl::unexpected(record.error());
    for (float& mV : record->trace.mV) mV *= static_cast<float>(file.gain);
    if (!input.signals.empty() && input.signals[0].number == record->signal) {
      return fail(fmt::format("{}: signal {} is asked for twice", file.path, record->signal));
    }
    if (input.signals.empty()) {
      input.trace = std::move(record->trace);
    } else if (auto joined = join(input.trace, std::move(record->trace), file.path); !joined) {
      return tl::unexpected(joined.error());
    }
    input.signals.push_back({record->signal, std::move(record->description)});
  }
  return input;
}

Expected<EcgInput> read_table(const EcgFile& file) {
  const auto text = read_whole(file.path, "ECG table");
  if (!text) return tl::unexpected(text.error());
  const auto lead = [&](std::size_t which) {
    const auto column = which < file.columns.size() ? std::optional(file.columns[which]) : std::nullopt;
    return parse_ecg_csv(*text, file.path, {file.rate_hz, column, file.gain});
  };
  auto first = lead(0);
  if (!first) return tl::unexpected(first.error());
  EcgInput input;
  input.trace = *std::move(first);
  if (file.columns.size() < 2) return input;
  auto second = lead(1);
  if (!second) return tl::unexpected(second.error());
  if (auto joined = join(input.trace, *std::move(second), file.path); !joined) return tl::unexpected(joined.error());
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
  if (path.extension() == ".mcap" && (file.rate_hz || !file.columns.empty())) {
    return "a recording knows its rate and channel: leave out --rate and --column";
  }
  if (is_wfdb(path) && file.rate_hz) return "a WFDB record knows its rate: leave out --rate";
  if (!is_wfdb(path) && !file.signals.empty()) return "--signal chooses of a WFDB record; a table has --column";
  if (!file.columns.empty() && !file.signals.empty()) return "--signal and --column say the same: leave out one";
  if (file.columns.size() > 2 || file.signals.size() > 2) return "of an ECG one lead or two are taken, no more";
  if (file.columns.size() == 2 && file.columns[0] == file.columns[1]) return "--column: two leads lie in two columns";
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
