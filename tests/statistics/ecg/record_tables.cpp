// What the detector and the classer make of whole records.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "daemon/evaluation/ecg/beat_score.hpp"
#include "quantiles.hpp"
#include "tables.hpp"

namespace perimap::test {
namespace {

constexpr double kSure = 0.9;

// One record's figures, or sums over several.
struct Figures {
  std::string name;
  double f1 = 0.0;
  double sure_percent = 0.0;  // of the true beats
  double mean_confidence = 0.0;
  int told_sure = 0;
  int true_of_sure = 0;
  int told_half = 0;  // with 0.45 to 0.55
  int true_of_half = 0;
  double median_s = 0.0;
  double p95_s = 0.0;
  double longest_s = 0.0;
};

Figures figures_of(const RecordedLead& record) {
  const EcgAnalysis analysis = analysed(record);
  const std::vector<int> matched = match_beats(record.beats, analysis.beats);
  Figures f;
  f.name = record.name;
  std::vector<bool> is_true(analysis.beats.size(), false);
  for (const int i : matched) {
    if (i >= 0) is_true[static_cast<std::size_t>(i)] = true;
  }
  std::vector<double> delays_s;
  int found = 0;
  int sure = 0;
  for (std::size_t i = 0; i < analysis.beats.size(); ++i) {
    const RPeak& peak = analysis.beats[i].peak;
    delays_s.push_back(to_seconds(peak.detected_at - peak.time));
    f.told_sure += peak.confidence >= kSure ? 1 : 0;
    f.true_of_sure += peak.confidence >= kSure && is_true[i] ? 1 : 0;
    const bool half = std::abs(peak.confidence - 0.5) < 0.05;
    f.told_half += half ? 1 : 0;
    f.true_of_half += half && is_true[i] ? 1 : 0;
    if (!is_true[i]) continue;
    ++found;
    sure += peak.confidence >= kSure ? 1 : 0;
    f.mean_confidence += peak.confidence;
  }
  f.f1 = 200.0 * found / static_cast<double>(record.beats.size() + analysis.beats.size());
  f.sure_percent = 100.0 * sure / std::max(found, 1);
  f.mean_confidence /= std::max(found, 1);
  f.median_s = quantile(delays_s, 0.5);
  f.p95_s = quantile(delays_s, 0.95);
  f.longest_s = quantile(delays_s, 1.0);
  return f;
}

struct PartFigures {
  std::vector<std::string> cells;
};

PartFigures part_figures(const std::vector<Figures>& all) {
  double f1 = 0.0;
  double sure = 0.0;
  double confidence = 0.0;
  double slowest_median_s = 0.0;
  double slowest_p95_s = 0.0;
  double longest_s = 0.0;
  int told_sure = 0;
  int true_of_sure = 0;
  int told_half = 0;
  int true_of_half = 0;
  for (const Figures& f : all) {
    const double n = static_cast<double>(all.size());
    f1 += f.f1 / n;
    sure += f.sure_percent / n;
    confidence += f.mean_confidence / n;
    told_sure += f.told_sure;
    true_of_sure += f.true_of_sure;
    told_half += f.told_half;
    true_of_half += f.true_of_half;
    slowest_median_s = std::max(slowest_median_s, f.median_s);
    slowest_p95_s = std::max(slowest_p95_s, f.p95_s);
    longest_s = std::max(longest_s, f.longest_s);
  }
  const auto lowest =
      std::min_element(all.begin(), all.end(), [](const Figures& a, const Figures& b) { return a.f1 < b.f1; });
  return {{fmt::format("{:.3f}", f1), fmt::format("{:.2f} ({})", lowest->f1, lowest->name), fmt::format("{:.1f}", sure),
           fmt::format("{:.3f}", confidence), fmt::format("{} of {}", true_of_sure, told_sure),
           fmt::format("{} of {}", true_of_half, told_half), fmt::format("{:.0f}", 1e3 * slowest_median_s),
           fmt::format("{:.0f}", 1e3 * slowest_p95_s), fmt::format("{:.2f}", longest_s)}};
}

}  // namespace

void print_records(const std::vector<RecordedLead>& records) {
  const std::vector<std::string> rows{"mean F1 without 207, %",
                                      "lowest F1, %",
                                      "true beats with a confidence of 0.9 and more, mean of the records, %",
                                      "mean confidence of true beats, mean of the records",
                                      "beats of those told with 0.9 and more",
                                      "beats of those told with 0.45 to 0.55",
                                      "largest median delay of a record, ms",
                                      "largest 95 % delay of a record, ms",
                                      "longest delay, s"};
  std::vector<Figures> all;
  std::vector<PartFigures> parts;
  std::string head = "| without 207 |";
  std::string line = "|---|";
  for (const bool aside : {false, true}) {
    std::vector<Figures> of_part;
    for (const RecordedLead& record : part_of(records, aside, true)) {
      all.push_back(figures_of(record));
      if (record.name != "207") of_part.push_back(all.back());
    }
    if (of_part.empty()) continue;
    head += aside ? " aside |" : " development |";
    line += "---|";
    parts.push_back(part_figures(of_part));
  }
  fmt::print("{}\n{}\n", head, line);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    fmt::print("| {} |", rows[row]);
    for (const PartFigures& part : parts) fmt::print(" {} |", part.cells[row]);
    fmt::print("\n");
  }
  fmt::print(
      "\n| record | F1, % | true beats with 0.9 and more, % | mean confidence | delay median / 95 % / longest, ms "
      "|\n|---|---|---|---|---|\n");
  for (const Figures& f : all) {
    fmt::print("| {} | {:.2f} | {:.1f} | {:.3f} | {:.0f} / {:.0f} / {:.0f} |\n", f.name, f.f1, f.sure_percent,
               f.mean_confidence, 1e3 * f.median_s, 1e3 * f.p95_s, 1e3 * f.longest_s);
  }
}

void print_ventricular(const std::vector<RecordedLead>& records) {
  // Supraventricular, fusion and escape beats count neither way.
  constexpr std::string_view kNeither = "AaJSFfejnEQ";
  fmt::print(
      "| record | part | ventricular | not found as beats | classed premature | false |\n|---|---|---|---|---|---|\n");
  struct Sums {
    int all = 0;
    int missed = 0;
    int hits = 0;
    int false_ones = 0;
    void print(std::string_view name, std::string_view part) const {
      fmt::print("| {} | {} | {} | {} | {} | {} |\n", name, part, all, missed, hits, false_ones);
    }
    void add(const Sums& other) {
      all += other.all;
      missed += other.missed;
      hits += other.hits;
      false_ones += other.false_ones;
    }
  };
  std::vector<Sums> parts(2);
  for (const RecordedLead& record : records) {
    const EcgAnalysis analysis = analysed(record);
    const std::vector<int> matched = match_beats(record.beats, analysis.beats);
    std::vector<std::string_view> symbols(analysis.beats.size(), "");
    Sums sums;
    for (std::size_t i = 0; i < record.beats.size(); ++i) {
      const bool ventricular = record.beats[i].symbol == "V";
      sums.all += ventricular ? 1 : 0;
      if (matched[i] < 0) {
        sums.missed += ventricular ? 1 : 0;
        continue;
      }
      symbols[static_cast<std::size_t>(matched[i])] = record.beats[i].symbol;
    }
    for (std::size_t i = 0; i < analysis.beats.size(); ++i) {
      if (analysis.beats[i].peak.beat_class != BeatClass::kPremature) continue;
      const std::string_view symbol = symbols[i];
      if (symbol == "V") {
        ++sums.hits;
      } else if (symbol.empty() || kNeither.find(symbol) == std::string_view::npos) {
        ++sums.false_ones;
      }
    }
    sums.print(record.name, record.aside ? "aside" : "development");
    parts[record.aside ? 1 : 0].add(sums);
  }
  Sums both = parts[0];
  both.add(parts[1]);
  const auto conclude = [](const Sums& sums, std::string_view name) {
    sums.print("sum", name);
    fmt::print("| sensitivity, precision, % | {} | {:.1f} | | {:.1f} | |\n", name,
               100.0 * sums.hits / std::max(sums.all, 1), 100.0 * sums.hits / std::max(sums.hits + sums.false_ones, 1));
  };
  conclude(parts[0], "development");
  conclude(parts[1], "aside");
  conclude(both, "all");
}

void print_prediction(const std::vector<RecordedLead>& records) {
  fmt::print("| record | cycles | previous, ms | mean of 8 | AR(8) | AR(8) / previous |\n|---|---|---|---|---|---|\n");
  double log_ratio = 0.0;
  for (const RecordedLead& record : records) {
    const PredictionErrors errors = prediction_errors(analysed(record), record.beats);
    if (!errors.rms_s) continue;
    const auto& rms = *errors.rms_s;
    fmt::print("| {}{} | {} | {:.1f} | {:.1f} | {:.1f} | {:.2f} |\n", record.name, record.aside ? ", aside" : "",
               errors.cycles, 1e3 * rms[0], 1e3 * rms[1], 1e3 * rms[2], rms[2] / rms[0]);
    log_ratio += std::log(rms[2] / rms[0]) / static_cast<double>(records.size());
  }
  fmt::print("| geometric mean | | | | | {:.3f} |\n", std::exp(log_ratio));
}

void print_starts(const std::vector<RecordedLead>& records) {
  constexpr double kSession_s = 12.0;
  constexpr double kEvery_s = 15.0;
  fmt::print(
      "| part | starts | beats | missed | false | the third beat is known after, s, mean "
      "|\n|---|---|---|---|---|---|\n");
  for (const bool aside : {false, true}) {
    int starts = 0;
    int beats = 0;
    int missed = 0;
    int extra = 0;
    double third_s = 0.0;
    int with_three = 0;
    for (const RecordedLead& record : part_of(records, aside, false)) {
      for (double at_s = 0.0; at_s + kSession_s < record.trace.time_s.back(); at_s += kEvery_s) {
        const RecordedLead session = stretch_of(record, at_s, kSession_s);
        const EcgAnalysis analysis = analysed(session);
        const std::vector<int> matched = match_beats(session.beats, analysis.beats);
        const auto found = std::count_if(matched.begin(), matched.end(), [](int i) { return i >= 0; });
        ++starts;
        beats += static_cast<int>(session.beats.size());
        missed += static_cast<int>(session.beats.size()) - static_cast<int>(found);
        extra += static_cast<int>(analysis.beats.size()) - static_cast<int>(found);
        if (analysis.beats.size() < 3) continue;
        ++with_three;
        third_s += to_seconds(analysis.beats[2].peak.detected_at.time_since_epoch());
      }
    }
    if (starts == 0) continue;
    fmt::print("| {} | {} | {} | {} | {} | {:.2f} |\n", aside ? "aside" : "development", starts, beats, missed, extra,
               third_s / std::max(with_three, 1));
  }
}

}  // namespace perimap::test
