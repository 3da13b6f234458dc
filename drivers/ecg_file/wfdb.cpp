#include "drivers/ecg_file/wfdb.hpp"

#include <fmt/format.h>

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
    if (words[0].find('/') != std::string_view::npos)
      return wrong("records of several segments are not read", words[0]);
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
    WfdbSignal signal;
    signal.file = words[0];
    if (words.size() < 2) return wrong("expected a file and a format", words[0]);
    std::string_view format = words[1];  // FORMAT[xSAMPLES][:SKEW][+OFFSET]
    const auto number = leading<int>(format);
    if (!number || (*number != 16 && *number != 212)) return wrong("only formats 16 and 212 are read", words[1]);
    signal.format = *number;
    if (!format.empty() && format.front() == '+') {
      format.remove_prefix(1);
      const auto offset = leading<std::size_t>(format);
      if (!offset) return wrong("expected a byte offset", words[1]);
      signal.byte_offset = *offset;
    }
    if (!format.empty()) return wrong("neither several samples a frame nor a skew are read", words[1]);

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
      if (!gain.empty() && gain != "/mV") {
        if (gain != "/uV") return wrong("expected a gain in counts per mV", words[2]);
        signal.gain *= 1000.0;
      }
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
  std::size_t signals_ = 0;
  WfdbHeader header_;
};

constexpr int kInvalid212 = -2048;
constexpr int kInvalid16 = -32768;

// Sample i of a file of format 212: two samples in three bytes, least significant bits first.
int sample_212(std::span<const std::uint8_t> bytes, std::size_t i) {
  const std::size_t at = i / 2 * 3;
  const int value = i % 2 == 0 ? bytes[at] | (bytes[at + 1] & 0x0F) << 8 : bytes[at + 2] | (bytes[at + 1] & 0xF0) << 4;
  return value >= 2048 ? value - 4096 : value;
}

int sample_16(std::span<const std::uint8_t> bytes, std::size_t i) {
  return static_cast<std::int16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8);
}

std::size_t samples_in(int format, std::size_t bytes) {
  return format == 16 ? bytes / 2 : bytes / 3 * 2 + (bytes % 3 == 2 ? 1 : 0);
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
  std::size_t in_file = 0;   // signals that share the file
  std::size_t position = 0;  // of the wanted one among them
  for (std::size_t i = 0; i < header.signals.size(); ++i) {
    if (header.signals[i].file != wanted.file) continue;
    if (header.signals[i].format != wanted.format) return fail(name + ": its signals are of several formats");
    if (i == signal) position = in_file;
    ++in_file;
  }
  if (wanted.byte_offset > bytes.size()) {
    return fail(fmt::format("{}: byte {}: the file ends before its first sample", name, bytes.size()));
  }
  bytes = bytes.subspan(wanted.byte_offset);
  const std::size_t held = samples_in(wanted.format, bytes.size()) / in_file;
  const std::size_t frames = header.frames > 0 ? header.frames : held;
  if (held < frames) {
    return fail(fmt::format("{}: byte {}: the file ends after {} of {} samples", name,
                            wanted.byte_offset + bytes.size(), held, frames));
  }
  if (frames == 0) return fail(name + ": there are no samples in it");

  EcgTrace trace;
  trace.time_s.reserve(frames);
  trace.mV.reserve(frames);
  std::uint16_t sum = 0;
  for (std::size_t frame = 0; frame < frames; ++frame) {
    const std::size_t i = frame * in_file + position;
    const int count = wanted.format == 16 ? sample_16(bytes, i) : sample_212(bytes, i);
    sum = static_cast<std::uint16_t>(sum + static_cast<unsigned>(count));
    const bool invalid = count == (wanted.format == 16 ? kInvalid16 : kInvalid212);
    const double mV = (static_cast<double>(count) - wanted.baseline) / wanted.gain;
    trace.time_s.push_back(static_cast<double>(frame) / header.rate_hz);
    trace.mV.push_back(invalid ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(mV));
  }
  if (wanted.has_checksum && header.frames > 0 && sum != static_cast<std::uint16_t>(wanted.checksum)) {
    return fail(
        fmt::format("{}: the samples of signal {} do not have the checksum {} that the header gives: the file is "
                    "damaged, or not of this record",
                    name, signal + 1, wanted.checksum));
  }
  return trace;
}

std::vector<std::filesystem::path> wfdb_files(const std::string& header_file) {
  std::vector<std::filesystem::path> files{header_file};
  const auto header = read_header(header_file);
  if (!header) return files;
  for (const WfdbSignal& signal : header->signals) files.push_back(files.front().parent_path() / signal.file);
  return files;
}

Expected<EcgTrace> read_wfdb(const std::string& header_file, int signal) {
  const auto header = read_header(header_file);
  if (!header) return tl::unexpected(header.error());
  const auto signals = static_cast<int>(header->signals.size());
  if (signal < 1 || signal > signals) {
    return fail(fmt::format("{}: there is no signal {}; it has {}", header_file, signal, signals));
  }
  const auto index = static_cast<std::size_t>(signal - 1);
  const std::filesystem::path named(header->signals[index].file);
  if (named.has_parent_path()) return fail(header_file + ": its signals must lie beside it");
  const std::filesystem::path file = std::filesystem::path(header_file).parent_path() / named;
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (!error && size > kLargestSignals) return fail(file.string() + ": is too large");
  const auto data = read_text_file(file, error ? 0 : static_cast<std::size_t>(size), "WFDB signal file");
  if (!data) return tl::unexpected(data.error());
  const std::span bytes(reinterpret_cast<const std::uint8_t*>(data->data()), data->size());
  return decode_wfdb_signal(*header, index, bytes, file.string());
}

}  // namespace perimap
