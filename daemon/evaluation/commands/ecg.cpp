// `perimap ecg`: beats, classes and predictions of an ECG.
#include <fmt/format.h>

#include <cstddef>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "daemon/command_line/commands.hpp"
#include "daemon/command_line/outputs.hpp"
#include "daemon/command_line/progress.hpp"
#include "daemon/command_line/same_file.hpp"
#include "daemon/evaluation/ecg/ecg_input.hpp"
#include "daemon/evaluation/ecg/ecg_text.hpp"
#include "daemon/process/stop_signal.hpp"
#include "drivers/json/json_text.hpp"
#include "drivers/text_file/text_file.hpp"

namespace perimap {
namespace {

constexpr std::size_t kLongWithoutProgress = 1'000'000;  // samples
constexpr double kReferenceEndsEarly_s = 5.0;            // longer than hearts pause

struct EcgOptions {
  EcgFile ecg;
  std::string beats;
  std::string reference;
  bool json = false;
};

// What is wrong with the options; empty when nothing is.
std::string misuse(const EcgOptions& options) {
  if (std::string wrong = misfit(options.ecg); !wrong.empty()) return wrong;
  const auto apart = check_apart({{"--beats", options.beats}},
                                 {{"INPUT itself", options.ecg.path}, {"the file of --reference", options.reference}});
  if (!apart) return apart.error().message;
  for (const auto& file : files_of(options.ecg)) {
    if (is_same_file(options.beats, file)) return fmt::format("--beats: is {}, of the record INPUT", file.string());
  }
  return {};
}

// None: a signal came.
std::optional<EcgAnalysis> analyse_until_stopped(const EcgTrace& trace, StopSignal& stop, const Console& console) {
  std::optional<Progress> progress;
  if (trace.mV.size() > kLongWithoutProgress) progress.emplace(console, "samples", trace.mV.size());
  bool stopped = false;
  EcgAnalysis analysis = analyse(trace, [&](std::size_t done) {
    if (progress) progress->update(done);
    stopped = stopped || stop.requested();
    return !stopped;
  });
  if (stopped) return std::nullopt;
  return analysis;
}

// A line that says so; empty where it reaches to the end.
std::string reference_ends_early(const EcgOptions& options, const BeatTable& reference, const EcgTrace& trace) {
  const double ends_s = trace.time_s.back();
  if (reference.beats.empty() || reference.beats.back().time_s >= ends_s - kReferenceEndsEarly_s) return {};
  return fmt::format(
      "{}: its last beat is at {:.1f} s, the ECG ends at {:.1f} s: beats found in between count as false",
      options.reference, reference.beats.back().time_s, ends_s);
}

Outcome find_beats(const EcgOptions& options, const Console& console) {
  if (const std::string wrong = misuse(options); !wrong.empty()) return refuse(wrong, ExitCode::kWrongUsage);
  if (auto able = check_writable({{"--beats", options.beats}}); !able) return refuse(able.error());
  auto stop = StopSignal::install();
  if (!stop) return refuse(stop.error());
  const auto input = read_ecg(options.ecg);
  if (!input) return refuse(input.error());
  BeatTable reference;
  if (!options.reference.empty()) {
    auto beats = read_beats(options.reference);
    if (!beats) return refuse(beats.error());
    reference = *std::move(beats);
  }
  for (const Error& damage : input->damage) console.complain(damage);
  console.complain(input->whole_until);
  console.complain(reference_ends_early(options, reference, input->trace));
  const auto analysis = analyse_until_stopped(input->trace, *stop, console);
  if (!analysis) return refuse("stopped by a signal; nothing was written");

  if (!options.beats.empty()) {
    if (auto written = write_text_file(options.beats, beat_rows(*analysis)); !written) return refuse(written.error());
  }
  const PredictionErrors errors = prediction_errors(*analysis, reference.beats);
  std::optional<BeatScore> score;
  if (!reference.beats.empty()) score = score_beats(reference.beats, *analysis, input->trace);
  if (!options.json) {
    for (const EcgLead& lead : input->signals) fmt::print("signal      {} of the record: {}\n", lead.number, lead.name);
    fmt::print("{}{}", to_text(*analysis, errors), score ? to_text(*score, reference.left_out) : "");
    return {};
  }
  nlohmann::json json = to_json(*analysis, errors);
  json["input"] = options.ecg.path;
  json["input_damage"] = nlohmann::json::array();
  for (const Error& damage : input->damage) json["input_damage"].push_back(damage.message);
  for (std::size_t i = 0; i < input->signals.size(); ++i) {
    const EcgLead& lead = input->signals[i];
    json[i == 0 ? "signal" : "second_signal"] = {{"number", lead.number}, {"name", lead.name}};
  }
  if (!reference.beats.empty()) json["reference_ends_s"] = reference.beats.back().time_s;
  if (score) json["score"] = to_json(*score, reference.left_out);
  fmt::print("{}", json_document(json));
  return {};
}

}  // namespace

void add_ecg_command(Commands& commands) {
  const auto options = std::make_shared<EcgOptions>();
  Command& command =
      commands.add("ecg", "Find and class the beats of an ECG as the daemon would, and score them against a reference",
                   [options](const Console& console) { return find_beats(*options, console); });
  command
      .add_option("INPUT", options->ecg.path,
                  "A table of time_s,mV a line or of values alone with --rate (CSV), a WFDB record (.hea, .dat or its "
                  "name, formats 16, 24, 32, 61, 80 and 212), or a recording (.mcap); of a damaged recording what is "
                  "whole, and it is said what is not")
      ->required();
  command.add_option("--beats", options->beats,
                     "Write the beats to this table, over an earlier one but not over what is read: "
                     "time_s,class,confidence,detected_at_s; classes normal, premature, "
                     "pause, noise; times of a recording count from its first ECG sample");
  command
      .add_option("--rate", options->ecg.rate_hz,
                  "Samples a second of a table without times; times that its heading names are passed over, and the "
                  "first sample is at 0 s")
      ->check(Range(1.0, 100000.0));
  command
      .add_option("--column", options->ecg.columns,
                  "Column of the table that holds the ECG, from 1 [2 beside times, 1 of values alone; several "
                  "columns without times need it]; of a WFDB record the number of its signal, as --signal. With two, "
                  "as 2,3 or given twice, two leads of the heart are heard, of which one is enough at any time")
      ->delimiter(',')
      ->one_at_a_time()
      ->check(Range(1, 10000));
  command
      .add_option("--signal", options->ecg.signals,
                  "Signal of a WFDB record, by its name in the header or its number from 1 [the first that is named "
                  "as a lead of an ECG is]. Given twice, or as MLII,V5: two leads. Of a recording with two both are "
                  "heard")
      ->one_at_a_time();
  command.add_option("--gain", options->ecg.gain, "mV a unit of the input; the beats do not depend on it [1]");
  command.add_option("--reference", options->reference,
                     "Score against these beats: a table of time_s, or with a kind in a column that the heading calls "
                     "symbol or class (without a heading in the second): MIT-BIH symbols, of which those that are no "
                     "beats are left out, * any other beat, or the words normal and premature. A beat counts as found "
                     "within 150 ms");
  command.add_flag("--json", options->json, "Print the figures as JSON");
}

}  // namespace perimap
