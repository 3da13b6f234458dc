#include "daemon/evaluation/commands/ecg.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/phase/ecg_filter.hpp"
#include "core/statistics/upper_median.hpp"
#include "core/time/instant.hpp"
#include "daemon/commands/progress.hpp"
#include "daemon/commands/same_file.hpp"
#include "daemon/evaluation/ecg/beat_score.hpp"
#include "daemon/evaluation/ecg/ecg_analysis.hpp"
#include "daemon/process/stop_signal.hpp"
#include "drivers/ecg_file/beat_table.hpp"
#include "drivers/ecg_file/ecg_csv.hpp"
#include "drivers/ecg_file/wfdb.hpp"
#include "drivers/recording/channels.hpp"
#include "drivers/recording/recording_reader.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLargestTable = std::size_t{1} << 32;
constexpr double kReferenceEndsEarly_s = 5.0;            // longer than hearts pause
constexpr std::size_t kLongWithoutProgress = 1'000'000;  // samples

struct Options {
  std::string input;
  std::string beats;
  std::string reference;
  std::optional<double> rate_hz;
  std::optional<int> column;
  std::string signal;
  double gain = 1.0;
  bool json = false;
};

Expected<std::string> read_whole(const std::string& file, std::string_view what) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (!error && size > kLargestTable) return fail(file + ": is too large");
  return read_text_file(file, error ? 0 : static_cast<std::size_t>(size), what);
}

struct Input {
  EcgTrace trace;
  std::vector<Error> damage;                          // what of the file could not be read
  std::optional<std::pair<int, std::string>> signal;  // of a record, that was read: from 1, as its header calls it
};

// The ECG channel of a recording; samples while the lead was off have no value. What is whole of a damaged one is
// taken.
Expected<Input> read_recorded(const std::string& file, double gain) {
  auto reader = RecordingReader::open(file, ReadMode::kWhole);
  if (!reader) return tl::unexpected(reader.error());
  const std::array wanted{channels::kEcgSamples};
  const auto selected = reader->select(wanted);
  Input input;
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

// What is read must not be written over. Empty when it is not.
std::string overwritten(const Options& options) {
  const std::filesystem::path path(options.input);
  if (is_same_file(options.beats, options.input)) return "--beats: is INPUT itself";
  if (is_same_file(options.beats, options.reference)) return "--beats: is the file of --reference";
  if (!is_wfdb(path)) return {};
  auto record = wfdb_files(wfdb_header(path));
  record.push_back(std::filesystem::path(path).replace_extension(".dat"));
  for (const auto& file : record) {
    if (is_same_file(options.beats, file)) return fmt::format("--beats: is {}, of the record INPUT", file.string());
  }
  return {};
}

// What is wrong with the options; empty when nothing is.
std::string misuse(const Options& options) {
  if (!std::isfinite(options.gain) || options.gain == 0.0) return "--gain must be a number other than 0";
  const std::filesystem::path path(options.input);
  if (path.extension() == ".mcap" && (options.rate_hz || options.column))
    return "a recording knows its rate and channel: leave out --rate and --column";
  if (is_wfdb(path) && options.rate_hz) return "a WFDB record knows its rate: leave out --rate";
  if (!is_wfdb(path) && !options.signal.empty()) return "--signal chooses of a WFDB record; a table has --column";
  if (options.column && !options.signal.empty()) return "--signal and --column say the same: leave out one";
  return overwritten(options);
}

Expected<Input> read_input(const Options& options) {
  const std::filesystem::path path(options.input);
  if (path.extension() == ".mcap") return read_recorded(options.input, options.gain);
  if (is_wfdb(path)) {
    const std::string wanted = options.column ? std::to_string(*options.column) : options.signal;
    auto record = read_wfdb(wfdb_header(path), wanted);
    if (!record) return tl::unexpected(record.error());
    for (float& mV : record->trace.mV) mV *= static_cast<float>(options.gain);
    return Input{std::move(record->trace), {}, std::pair(record->signal, std::move(record->description))};
  }
  const auto text = read_whole(options.input, "ECG table");
  if (!text) return tl::unexpected(text.error());
  auto trace = parse_ecg_csv(*text, options.input, {options.rate_hz, options.column, options.gain});
  if (!trace) return tl::unexpected(trace.error());
  return Input{*std::move(trace), {}, {}};
}

std::string_view name_of(BeatClass beat_class) {
  switch (beat_class) {
    case BeatClass::kNormal:
      return "normal";
    case BeatClass::kPremature:
      return "premature";
    case BeatClass::kPause:
      return "pause";
    case BeatClass::kNoise:
      return "noise";
  }
  return "";
}

std::string_view name_of(RrMethod method) {
  switch (method) {
    case RrMethod::kPrevious:
      return "previous";
    case RrMethod::kMeanOf8:
      return "mean_of_8";
    case RrMethod::kAutoregressive:
      return "autoregressive";
  }
  return "";
}

double seconds(Instant t) { return to_seconds(t.time_since_epoch()); }

std::string beat_rows(const EcgAnalysis& analysis) {
  std::string rows = "time_s,class,confidence,detected_at_s\n";
  for (const AnalysedBeat& beat : analysis.beats) {
    rows += fmt::format("{:.5f},{},{:.3f},{:.5f}\n", seconds(beat.peak.time), name_of(beat.peak.beat_class),
                        beat.peak.confidence, seconds(beat.peak.detected_at));
  }
  return rows;
}

std::array<int, 4> count_classes(const EcgAnalysis& analysis) {
  std::array<int, 4> classes{};
  for (const AnalysedBeat& beat : analysis.beats) ++classes[static_cast<std::size_t>(beat.peak.beat_class)];
  return classes;
}

nlohmann::json milliseconds(std::optional<double> s) { return s ? nlohmann::json(1e3 * *s) : nlohmann::json(nullptr); }

nlohmann::json to_json(const EcgAnalysis& analysis, const PredictionErrors& errors) {
  const auto delay = delay_figures(analysis);
  const auto classes = count_classes(analysis);
  const auto delay_ms = [&](double DelayFigures::*figure) {
    return delay ? milliseconds((*delay).*figure) : nlohmann::json(nullptr);
  };
  nlohmann::json json = {
      {"duration_s", analysis.duration_s},
      {"beats", analysis.beats.size()},
      {"classes", {{"normal", classes[0]}, {"premature", classes[1]}, {"pause", classes[2]}, {"noise", classes[3]}}},
      {"delay_ms", {{"median", delay_ms(&DelayFigures::median_s)}, {"p95", delay_ms(&DelayFigures::p95_s)}}},
      {"unusable_s", analysis.unusable_s},
      {"interruptions", analysis.interruptions},
      {"without_beats_s", analysis.without_beats_s},
      {"noisy_s", analysis.noisy_s},
      {"unpredictable_s", analysis.unpredictable_s},
      {"prediction", {{"cycles", errors.cycles}}}};
  for (std::size_t i = 0; i < kPredictionMethods.size(); ++i) {
    json["prediction"][std::string(name_of(kPredictionMethods[i])) + "_rms_ms"] =
        errors.rms_s ? milliseconds((*errors.rms_s)[i]) : nlohmann::json(nullptr);
  }
  return json;
}

nlohmann::json to_json(std::optional<double> figure) {
  return figure ? nlohmann::json(*figure) : nlohmann::json(nullptr);
}

nlohmann::json to_json(const Rate& rate) {
  return {{"percent", to_json(rate.percent())}, {"hits", rate.hits}, {"of", rate.all}};
}

nlohmann::json to_json(const BeatScore& score, std::size_t left_out) {
  nlohmann::json json = {{"sensitivity", to_json(score.sensitivity)},
                         {"positive_predictivity", to_json(score.positive_predictivity)},
                         {"f1_percent", to_json(score.f1_percent)},
                         {"annotations_left_out", left_out},
                         {"missed_s", score.missed_s},
                         {"extra_s", score.extra_s},
                         {"timing_ms",
                          {{"beats", score.timed},
                           {"median", milliseconds(score.timing_median_s)},
                           {"rms", milliseconds(score.timing_rms_s)},
                           {"to_local_peak_rms", milliseconds(score.peak_rms_s)}}}};
  if (!score.has_kinds) return json;
  json["premature"] = {{"sensitivity", to_json(score.premature_sensitivity)},
                       {"precision", to_json(score.premature_precision)}};
  for (const auto& [symbol, counts] : score.symbols) {
    json["symbols"][symbol] = {{"normal", counts[0]},
                               {"premature", counts[1]},
                               {"pause", counts[2]},
                               {"noise", counts[3]},
                               {"missed", counts[4]}};
  }
  return json;
}

std::string to_text(const EcgAnalysis& analysis, const PredictionErrors& errors) {
  const auto classes = count_classes(analysis);
  std::string text =
      fmt::format("beats       {} in {:.1f} s: {} normal, {} premature, {} after a pause, {} thought noise\n",
                  analysis.beats.size(), analysis.duration_s, classes[0], classes[1], classes[2], classes[3]);
  const auto delay = delay_figures(analysis);
  text += "delay       R peak to detection, median / 95 %: ";
  text += delay ? fmt::format("{:.0f} / {:.0f} ms\n", 1e3 * delay->median_s, 1e3 * delay->p95_s) : "none\n";
  text += fmt::format(
      "signal      unusable for {:.1f} s, interrupted {} times, without beats for {:.1f} s, noisy for {:.1f} s; rhythm "
      "unpredictable for {:.1f} s\n",
      analysis.unusable_s, analysis.interruptions, analysis.without_beats_s, analysis.noisy_s,
      analysis.unpredictable_s);
  if (!errors.rms_s) return text + "prediction  next cycle: none, there are no normal cycles to tell it from\n";
  const auto& rms_s = *errors.rms_s;
  return text + fmt::format(
                    "prediction  next cycle, RMS over {} normal cycles: previous {:.1f}, mean of 8 {:.1f}, "
                    "autoregressive {:.1f} ms\n",
                    errors.cycles, 1e3 * rms_s[0], 1e3 * rms_s[1], 1e3 * rms_s[2]);
}

std::string to_text(const Rate& rate) {
  const auto percent = rate.percent();
  return fmt::format("{} ({} of {})", percent ? fmt::format("{:.2f} %", *percent) : "none", rate.hits, rate.all);
}

std::string to_text(const BeatScore& score, std::size_t left_out) {
  std::string text = fmt::format("reference   sensitivity {}, positive predictivity {}, F1 {}\n",
                                 to_text(score.sensitivity), to_text(score.positive_predictivity),
                                 score.f1_percent ? fmt::format("{:.3f} %", *score.f1_percent) : "none");
  if (left_out > 0) text += fmt::format("            annotations in it that are no beats, left out: {}\n", left_out);
  text += "timing      normal beats to the reference: ";
  text += score.timing_median_s ? fmt::format("median {:+.1f} ms, RMS about it {:.1f} ms", 1e3 * *score.timing_median_s,
                                              1e3 * *score.timing_rms_s)
                                : "none";
  if (score.peak_rms_s) text += fmt::format("; to the local peak: RMS {:.1f} ms", 1e3 * *score.peak_rms_s);
  text += '\n';
  if (!score.has_kinds) return text;
  text += fmt::format("premature   sensitivity {}, precision {}\n", to_text(score.premature_sensitivity),
                      to_text(score.premature_precision));
  for (const auto& [symbol, counts] : score.symbols) {
    text += fmt::format("  {:<9} normal {}, premature {}, pause {}, noise {}, missed {}\n", symbol, counts[0],
                        counts[1], counts[2], counts[3], counts[4]);
  }
  return text;
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

Expected<void> run(const Options& options) {
  auto stop = StopSignal::install();
  if (!stop) return tl::unexpected(stop.error());
  const auto input = read_input(options);
  if (!input) return tl::unexpected(input.error());
  const EcgTrace& trace = input->trace;
  if (auto fits = check_rate(trace, options.input); !fits) return fits;
  BeatTable reference;
  if (!options.reference.empty()) {
    const auto text = read_whole(options.reference, "table of reference beats");
    if (!text) return tl::unexpected(text.error());
    auto beats = parse_beat_table(*text, options.reference);
    if (!beats) return tl::unexpected(beats.error());
    reference = *std::move(beats);
  }
  for (const Error& damage : input->damage) fmt::print(stderr, "perimap ecg: {}\n", damage.message);
  if (!input->damage.empty()) {
    fmt::print(stderr, "perimap ecg: {}: is damaged: what is whole of its ECG ends {:.3f} s after its first sample\n",
               options.input, trace.time_s.back());
  }

  const double ends_s = trace.time_s.back();
  const bool reference_ends_early =
      !reference.beats.empty() && reference.beats.back().time_s < ends_s - kReferenceEndsEarly_s;
  if (reference_ends_early) {
    fmt::print(
        stderr,
        "perimap ecg: {}: its last beat is at {:.1f} s, the ECG ends at {:.1f} s: beats found in between count as "
        "false\n",
        options.reference, reference.beats.back().time_s, ends_s);
  }
  std::optional<Progress> progress;
  if (trace.mV.size() > kLongWithoutProgress) progress.emplace("samples", trace.mV.size());
  bool stopped = false;
  const EcgAnalysis analysis = analyse(trace, [&](std::size_t done) {
    if (progress) progress->update(done);
    stopped = stopped || stop->requested();
    return !stopped;
  });
  progress.reset();
  if (stopped) return fail("stopped by a signal; nothing was written");

  if (!options.beats.empty()) {
    const auto written = write_text_file(options.beats, beat_rows(analysis));
    if (!written) return tl::unexpected(written.error());
  }
  const PredictionErrors errors = prediction_errors(analysis, reference.beats);
  std::optional<BeatScore> score;
  if (!reference.beats.empty()) score = score_beats(reference.beats, analysis, trace);
  if (options.json) {
    nlohmann::json json = to_json(analysis, errors);
    json["input"] = options.input;
    json["input_damage"] = nlohmann::json::array();
    for (const Error& damage : input->damage) json["input_damage"].push_back(damage.message);
    if (input->signal) json["signal"] = {{"number", input->signal->first}, {"name", input->signal->second}};
    if (score) json["score"] = to_json(*score, reference.left_out);
    if (!reference.beats.empty()) json["reference_ends_s"] = reference.beats.back().time_s;
    fmt::print("{}\n", json.dump(2));
  } else {
    if (input->signal) fmt::print("signal      {} of the record: {}\n", input->signal->first, input->signal->second);
    fmt::print("{}", to_text(analysis, errors));
    if (score) fmt::print("{}", to_text(*score, reference.left_out));
  }
  return {};
}

}  // namespace

void add_ecg_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "ecg", "Find and class the beats of an ECG as the daemon would, and score them against a reference");
  command
      ->add_option("INPUT", options->input,
                   "A table of time_s,mV a line or of values alone with --rate (CSV), a WFDB record (.hea, .dat or its "
                   "name, formats 16, 24, 32, 61, 80 and 212), or a recording (.mcap); of a damaged recording what is "
                   "whole, and it "
                   "is said what is not")
      ->required();
  command->add_option("--beats", options->beats,
                      "Write the beats to this table, over an earlier one but not over what is read: "
                      "time_s,class,confidence,detected_at_s; classes normal, premature, "
                      "pause, noise; times of a recording count from its first ECG sample");
  command
      ->add_option("--rate", options->rate_hz,
                   "Samples a second of a table without times; times that its heading names are passed over, and the "
                   "first sample is at 0 s")
      ->check(CLI::Range(1.0, 100000.0));
  command
      ->add_option("--column", options->column,
                   "Column of the table that holds the ECG, from 1 [2 beside times, 1 of values alone; several "
                   "columns without times need it]; of a WFDB record the number of its signal, as --signal")
      ->check(CLI::Range(1, 10000));
  command->add_option(
      "--signal", options->signal,
      "Signal of a WFDB record, by its name in the header or its number from 1 [the first that is named "
      "as a lead of an ECG is]");
  command->add_option("--gain", options->gain, "mV a unit of the input; the beats do not depend on it [1]");
  command->add_option("--reference", options->reference,
                      "Score against these beats: a table of time_s, or with a kind in a column that the heading calls "
                      "symbol or class (without a heading in the second): MIT-BIH symbols, of which those that are no "
                      "beats are left out, * any other beat, or the words normal and premature. A beat counts as found "
                      "within 150 ms");
  command->add_flag("--json", options->json, "Print the figures as JSON");
  command->callback([options, &exit_code] {
    if (const std::string wrong = misuse(*options); !wrong.empty()) {
      fmt::print(stderr, "perimap ecg: {}\n", wrong);
      exit_code = 2;
      return;
    }
    const auto done = run(*options);
    if (!done) fmt::print(stderr, "perimap ecg: {}\n", done.error().message);
    exit_code = done ? 0 : 1;
  });
}

}  // namespace perimap
