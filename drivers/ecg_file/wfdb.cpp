#include "drivers/ecg_file/wfdb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include "core/error/one_line.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLargestHeader = 1 << 20;
constexpr std::size_t kLargestSignals = std::size_t{1} << 31;
constexpr std::size_t kMostSignals = 64;
constexpr std::size_t kMostSamplesAFrame = 1000;
constexpr std::size_t kLargestSkew = 1000000;  // frames
constexpr double kHighestRate_hz = 1e5;

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (;;) {
    const std::size_t begin = line.find_first_not_of(" \t");
    if (begin == std::string_view::npos) return words;
    line.remove_prefix(begin);
    const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
    words.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

// The number that a word begins with, and what follows it.
template <class Number>
std::optional<Number> leading(std::string_view& word) {
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{}) return std::nullopt;
  word.remove_prefix(static_cast<std::size_t>(end - word.data()));
  return value;
}

template <class Number>
std::optional<Number> whole(std::string_view word) {
  const auto value = leading<Number>(word);
  return word.empty() ? value : std::nullopt;
}

class HeaderParser {
 public:
  explicit HeaderParser(std::string name) : name_(std::move(name)) {}

  Expected<WfdbHeader> parse(std::string_view text) {
    while (!text.empty() && !done()) {
      const std::size_t end = std::min(text.find('\n'), text.size());
      std::string_view line = text.substr(0, end);
      text.remove_prefix(std::min(end + 1, text.size()));
      ++line_;
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      const auto words = words_of(line);
      if (words.empty() || words[0].front() == '#') continue;
      const auto taken = has_record_ ? signal_line(words) : record_line(words);
      if (!taken) return tl::unexpected(taken.error());
    }
    if (!has_record_) return fail(name_ + ": there is no record line in it");
    if (header_.signals.size() < signals_) {
      return fail(fmt::format("{}:{}: {} of {} signals are described", name_, line_, header_.signals.size(), signals_));
    }
    return std::move(header_);
  }

 private:
  [[nodiscard]] bool done() const { return has_record_ && header_.signals.size() == signals_; }

  [[nodiscard]] tl::unexpected<Error> wrong(std::string_view what, std::string_view value) const {
    return fail(on_one_line(fmt::format("{}:{}: {}, found '{}'", name_, line_, what, value.substr(0, 40))));
  }

  Expected<void> record_line(const std::vector<std::string_view>& words) {
    has_record_ = true;
    // RECORD/SEGMENTS, or a record in a folder whose name is a number: the next line tells.
    const std::size_t slash = words[0].rfind('/');
    may_have_segments_ = slash != std::string_view::npos && whole<std::size_t>(words[0].substr(slash + 1)).has_value();
    if (words.size() < 2) return wrong("expected the number of signals", words[0]);
    const auto signals = whole<std::size_t>(words[1]);
    if (!signals || *signals == 0 || *signals > kMostSignals) return wrong("expected 1 to 64 signals", words[1]);
    signals_ = *signals;
    if (words.size() > 2) {
      std::string_view word = words[2];  // FREQUENCY[/COUNTER[(BASE)]]
      const auto rate = leading<double>(word);
      if (!rate || !(*rate > 0.0) || *rate > kHighestRate_hz || (!word.empty() && word.front() != '/')) {
        return wrong("expected a sample rate", words[2]);
      }
      header_.rate_hz = *rate;
    }
    if (words.size() > 3) {
      const auto frames = whole<std::size_t>(words[3]);
      if (!frames) return wrong("expected the number of samples", words[3]);
      header_.frames = *frames;
    }
    return {};
  }

  Expected<void> signal_line(const std::vector<std::string_view>& words) {
    if (may_have_segments_ && words.size() == 2 && words[0].find('.') == std::string_view::npos) {
      return wrong("records of several segments are not read", words[0]);
    }
    WfdbSignal signal;
    signal.file = words[0];
    if (words.size() < 2) return wrong("expected a file and a format", words[0]);
    std::string_view format = words[1];  // FORMAT[xSAMPLES][:SKEW][+OFFSET]
    const auto number = leading<int>(format);
    if (!number) return wrong("expected a format", words[1]);
    signal.format = *number;
    const auto option = [&](char mark, std::size_t& value) {
      if (format.empty() || format.front() != mark) return true;
      format.remove_prefix(1);
      const auto given = leading<std::size_t>(format);
      if (given) value = *given;
      return given.has_value();
    };
    if (!option('x', signal.samples_a_frame) || signal.samples_a_frame == 0 ||
        signal.samples_a_frame > kMostSamplesAFrame) {
      return wrong("expected the number of samples a frame", words[1]);
    }
    if (!option(':', signal.skew) || signal.skew > kLargestSkew) return wrong("expected a skew", words[1]);
    if (!option('+', signal.byte_offset)) return wrong("expected a byte offset", words[1]);
    if (!format.empty()) return wrong("expected FORMAT[xSAMPLES][:SKEW][+OFFSET]", words[1]);

    bool has_baseline = false;
    if (words.size() > 2) {
      std::string_view gain = words[2];  // GAIN[(BASELINE)][/UNITS]
      const auto counts = leading<double>(gain);
      if (!counts || !std::isfinite(*counts) || *counts < 0.0) return wrong("expected a gain", words[2]);
      if (*counts > 0.0) signal.gain = *counts;
      if (!gain.empty() && gain.front() == '(') {
        gain.remove_prefix(1);
        const auto baseline = leading<int>(gain);
        if (!baseline || gain.empty() || gain.front() != ')') return wrong("expected (BASELINE)", words[2]);
        gain.remove_prefix(1);
        signal.baseline = *baseline;
        has_baseline = true;
      }
      if (!gain.empty() && gain.front() != '/') return wrong("expected GAIN[(BASELINE)][/UNITS]", words[2]);
      if (!gain.empty()) signal.units = gain.substr(1);
    }
    if (words.size() > 4) {
      const auto zero = whole<int>(words[4]);
      if (!zero) return wrong("expected the converter's zero", words[4]);
      if (!has_baseline) signal.baseline = *zero;
    }
    if (words.size() > 6) {
      const auto checksum = whole<int>(words[6]);
      if (!checksum) return wrong("expected a checksum", words[6]);
      signal.checksum = *checksum;
      signal.has_checksum = true;
    }
    for (std::size_t i = 8; i < words.size(); ++i) {
      if (i > 8) signal.description += ' ';
      signal.description += words[i];
    }
    header_.signals.push_back(std::move(signal));
    return {};
  }

  std::string name_;
  std::size_t line_ = 0;
  bool has_record_ = false;
  bool may_have_segments_ = false;
  std::size_t signals_ = 0;
  WfdbHeader header_;
};

// How the samples of a format lie in a file.
struct Format {
  int number;
  std::size_t samples;  // in a group
  std::size_t bytes;    // of it
  std::int64_t none;    // a sample without value
};
constexpr std::array<Format, 6> kFormats{{{16, 1, 2, -32768},
                                          {24, 1, 3, -8388608},
                                          {32, 1, 4, -2147483648LL},
                                          {61, 1, 2, -32768},
                                          {80, 1, 1, -128},
                                          {212, 2, 3, -2048}}};

const Format* format_of(int number) {
  const auto* const found =
      std::find_if(kFormats.begin(), kFormats.end(), [&](const Format& format) { return format.number == number; });
  return found == kFormats.end() ? nullptr : found;
}

// Little-endian, two's complement.
std::int64_t whole_number(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) value |= std::uint64_t{bytes[i]} << (8 * i);
  const std::uint64_t sign = std::uint64_t{1} << (8 * bytes.size() - 1);
  return static_cast<std::int64_t>(value ^ sign) - static_cast<std::int64_t>(sign);
}

// Sample i of a file of format 212: two samples in three bytes, least significant bits first.
std::int64_t sample_212(std::span<const std::uint8_t> bytes, std::size_t i) {
  const std::size_t at = i / 2 * 3;
  const int value = i % 2 == 0 ? bytes[at] | (bytes[at + 1] & 0x0F) << 8 : bytes[at + 2] | (bytes[at + 1] & 0xF0) << 4;
  return value >= 2048 ? value - 4096 : value;
}

std::int64_t sample_of(const Format& format, std::span<const std::uint8_t> bytes, std::size_t i) {
  switch (format.number) {
    case 212:
      return sample_212(bytes, i);
    case 80:
      return std::int64_t{bytes[i]} - 128;
    case 61:
      return static_cast<std::int16_t>(bytes[2 * i] << 8 | bytes[2 * i + 1]);
    default:
      return whole_number(bytes.subspan(i * format.bytes, format.bytes));
  }
}

std::size_t samples_in(const Format& format, std::size_t bytes) {
  const std::size_t whole_groups = bytes / format.bytes * format.samples;
  return whole_groups + (format.number == 212 && bytes % 3 == 2 ? 1 : 0);
}

// Of a unit of the signal, in mV.
std::optional<double> millivolts_a_unit(std::string_view units) {
  if (units == "mV" || units == "mv") return 1.0;
  if (units == "uV" || units == "\u00B5V" || units == "\u03BCV") return 1e-3;
  if (units == "V") return 1e3;
  return std::nullopt;
}

std::string upper(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  return result;
}

// By name: "II", "MLII", "V5", "ECG lead 2", "ECG1".
bool is_lead(std::string_view description) {
  constexpr std::array<std::string_view, 18> kLeads{"I",    "II",   "III",   "AVR",  "AVL",  "AVF",
                                                    "MLI",  "MLII", "MLIII", "MCL1", "MCL2", "MCL3",
                                                    "MCL4", "D1",   "D2",    "D3",   "D4",   "CC5"};
  std::string name = upper(description);
  if (name.find("ECG") != std::string::npos || name.find("EKG") != std::string::npos) return true;
  if (name.starts_with("LEAD ")) name.erase(0, 5);
  if (std::find(kLeads.begin(), kLeads.end(), name) != kLeads.end()) return true;
  const bool chest = name.size() > 1 && (name.starts_with("V") || name.starts_with("CM") || name.starts_with("MV"));
  return chest && name.find_first_not_of("VCMR0123456789-") == std::string::npos;
}

bool is_something_else(std::string_view description) {
  constexpr std::array<std::string_view, 20> kOthers{"RESP", "PLETH", "PPG",  "ABP", "ART",  "BP",  "PAP",
                                                     "CVP",  "ICP",   "SPO2", "EEG", "EMG",  "EOG", "GSR",
                                                     "ACC",  "PULSE", "TEMP", "CO2", "FLOW", "SCG"};
  const std::string name = upper(description);
  return std::any_of(kOthers.begin(), kOthers.end(),
                     [&](std::string_view other) { return name.find(other) != std::string::npos; });
}

std::string what_there_is(const WfdbHeader& header) {
  std::string list;
  for (std::size_t i = 0; i < header.signals.size(); ++i) {
    list += fmt::format("{}{} {}", i > 0 ? ", " : "", i + 1, header.signals[i].description);
  }
  return list;
}

// Where a header says, in its folder or below; records are often copied without the folder, to beside their header.
Expected<std::filesystem::path> sample_file(const std::filesystem::path& header_file,
                                            const std::filesystem::path& named) {
  if (named.is_absolute() || std::find(named.begin(), named.end(), "..") != named.end()) {
    return fail(header_file.string() + ": its signals must lie in its folder or below");
  }
  const auto where = header_file.parent_path();
  std::error_code unknown;
  if (!std::filesystem::exists(where / named, unknown) && std::filesystem::exists(where / named.filename(), unknown)) {
    return where / named.filename();
  }
  return where / named;
}

Expected<WfdbHeader> read_header(const std::string& file) {
  const auto text = read_text_file(file, kLargestHeader, "WFDB header");
  if (!text) return tl::unexpected(text.error());
  if (text->size() > kLargestHeader) return fail(file + ": is too long for a WFDB header");
  return parse_wfdb_header(*text, file);
}

}  // namespace

Expected<WfdbHeader> parse_wfdb_header(std::string_view text, const std::string& name) {
  return HeaderParser(name).parse(text);
}

Expected<EcgTrace> decode_wfdb_signal(const WfdbHeader& header, std::size_t signal, std::span<const std::uint8_t> bytes,
                                      const std::string& name) {
  const WfdbSignal& wanted = header.signals.at(signal);
  const Format* const format = format_of(wanted.format);
  if (format == nullptr) {
    return fail(fmt::format("{}: signal {} is of format {}; 16, 24, 32, 61, 80 and 212 are read", name, signal + 1,
                            wanted.format));
  }
  const auto unit_mV = millivolts_a_unit(wanted.units);
  if (!unit_mV) {
    return fail(on_one_line(fmt::format("{}: signal {} is in {}, which is no voltage: choose another", name, signal + 1,
                                        wanted.units.substr(0, 20))));
  }
  std::size_t in_frame = 0;  // samples of all signals that share the file
  std::size_t position = 0;  // of the wanted ones among them
  for (std::size_t i = 0; i < header.signals.size(); ++i) {
    if (header.signals[i].file != wanted.file) continue;
    if (header.signals[i].format != wanted.format) return fail(name + ": its signals are of several formats");
    if (i == signal) position = in_frame;
    in_frame += header.signals[i].samples_a_frame;
  }
  if (wanted.byte_offset > bytes.size()) {
    return fail(fmt::format("{}: byte {}: the file ends before its first sample", name, bytes.size()));
  }
  bytes = bytes.subspan(wanted.byte_offset);
  const std::size_t held = samples_in(*format, bytes.size()) / in_frame;
  const std::size_t frames = header.frames > 0 ? header.frames : held;
  if (held < frames) {
    return fail(fmt::format("{}: byte {}: the file ends after {} of {} samples", name,
                            wanted.byte_offset + bytes.size(), held, frames));
  }
  if (frames <= wanted.skew) return fail(name + ": there are no samples in it");

  EcgTrace trace;
  const std::size_t each = wanted.samples_a_frame;
  const double rate_hz = header.rate_hz * static_cast<double>(each);
  std::uint16_t sum = 0;
  for (std::size_t k = 0; k < frames * each; ++k) {
    const std::int64_t count = sample_of(*format, bytes, k / each * in_frame + position + k % each);
    sum = static_cast<std::uint16_t>(sum + static_cast<std::uint64_t>(count));
    if (k < wanted.skew * each) continue;
    const double mV = (static_cast<double>(count) - wanted.baseline) / wanted.gain * *unit_mV;
    trace.time_s.push_back(static_cast<double>(trace.time_s.size()) / rate_hz);
    trace.mV.push_back(count == format->none ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(mV));
  }
  const bool checked = wanted.has_checksum && wanted.checksum != 0 && header.frames > 0;
  if (checked && sum != static_cast<std::uint16_t>(wanted.checksum)) {
    return fail(
        fmt::format("{}: the samples of signal {} do not have the checksum {} that the header gives: the file is "
                    "damaged, or not of this record",
                    name, signal + 1, wanted.checksum));
  }
  return trace;
}

Expected<std::size_t> choose_wfdb_signal(const WfdbHeader& header, const std::string& wanted, const std::string& name) {
  const auto& signals = header.signals;
  const auto first = [&](auto&& is) -> std::optional<std::size_t> {
    const auto found = std::find_if(signals.begin(), signals.end(), is);
    if (found == signals.end()) return std::nullopt;
    return static_cast<std::size_t>(found - signals.begin());
  };
  if (wanted.empty()) {
    if (const auto lead =
            first([](const WfdbSignal& s) { return is_lead(s.description) && millivolts_a_unit(s.units); }))
      return *lead;
    if (const auto other = first(
            [](const WfdbSignal& s) { return !is_something_else(s.description) && millivolts_a_unit(s.units); })) {
      return *other;
    }
    return fail(on_one_line(fmt::format("{}: none of its signals looks like an ECG; say which by --signal: {}", name,
                                        what_there_is(header))));
  }
  if (const auto named = first([&](const WfdbSignal& s) { return upper(s.description) == upper(wanted); }))
    return *named;
  const auto number = whole<int>(wanted);
  if (number && *number >= 1 && *number <= static_cast<int>(signals.size()))
    return static_cast<std::size_t>(*number - 1);
  return fail(on_one_line(fmt::format("{}: there is no signal {}; it has {}: {}", name, wanted.substr(0, 40),
                                      signals.size(), what_there_is(header))));
}

std::vector<std::filesystem::path> wfdb_files(const std::string& header_file) {
  std::vector<std::filesystem::path> files{header_file};
  const auto header = read_header(header_file);
  if (!header) return files;
  for (const WfdbSignal& signal : header->signals) {
    if (const auto file = sample_file(header_file, signal.file)) files.push_back(*file);
  }
  return files;
}

Expected<WfdbTrace> read_wfdb(const std::string& header_file, const std::string& signal) {
  const auto header = read_header(header_file);
  if (!header) return tl::unexpected(header.error());
  const auto index = choose_wfdb_signal(*header, signal, header_file);
  if (!index) return tl::unexpected(index.error());
  const WfdbSignal& chosen = header->signals[*index];
  const auto file = sample_file(header_file, chosen.file);
  if (!file) return tl::unexpected(file.error());
  std::error_code error;
  const auto size = std::filesystem::file_size(*file, error);
  if (!error && size > kLargestSignals) return fail(file->string() + ": is too large");
  const auto data = read_text_file(*file, error ? 0 : static_cast<std::size_t>(size), "WFDB signal file");
  if (!data) return tl::unexpected(data.error());
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(data->data()), data->size());
  auto trace = decode_wfdb_signal(*header, *index, bytes, file->string());
  if (!trace) return tl::unexpected(trace.error());
  return WfdbTrace{*std::move(trace), static_cast<int>(*index) + 1, chosen.description};
}

}  // namespace perimap
