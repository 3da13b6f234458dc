// The detector on leads that are drawn: how good it is, and whether it says so where it is not.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>

#include "core/phase/r_peak_detector.hpp"
#include "made_lead.hpp"
#include "tables.hpp"

namespace perimap::test {
namespace {

constexpr double kGoal_percent = 98.0;
// What one draw of leads after another has kept to: shares of those that are plain, and of the others.
constexpr double kMostBelow = 0.15;
constexpr double kMostPlainWrong = 0.01;
constexpr double kMostOthersWrong = 0.03;
constexpr int kByChance = 2;  // leads: twenty are no share

struct Cell {
  MadeLeadSettings settings;
  double f1 = 0.0;
  bool plain = false;
  bool wrong = false;   // confidently
  bool unsaid = false;  // F1 is below the goal, and beats of doubt and noise are less than what is wrong
};

Cell judged(const MadeLeadSettings& settings) {
  const MadeLead lead = make_lead(settings);
  const auto detector = std::make_unique<RPeakDetector>();
  std::vector<RPeak> peaks;
  int not_good = 0;
  const auto warm = static_cast<std::size_t>(5.0 * lead.rate_hz);
  for (std::size_t i = 0; i < lead.mV.size(); ++i) {
    const Instant t(from_seconds(static_cast<double>(i) / lead.rate_hz));
    if (const auto peak = detector->push(t, lead.mV[i])) peaks.push_back(*peak);
    not_good += i > warm && detector->signal() != EcgSignal::kGood ? 1 : 0;
  }
  while (const auto peak = detector->flush()) peaks.push_back(*peak);
  const MadeOutcome outcome = scored(lead, peaks);
  Cell cell;
  cell.settings = settings;
  cell.plain = is_plain(settings);
  cell.f1 = outcome.f1_percent();
  cell.wrong = outcome.confidently_wrong();
  const double noisy_beats = static_cast<double>(not_good) / static_cast<double>(lead.mV.size()) * outcome.beats;
  cell.unsaid = cell.f1 < kGoal_percent && outcome.doubted + noisy_beats < outcome.missed + outcome.extra;
  return cell;
}

struct Counts {
  int all = 0;
  int below = 0;
  int unsaid = 0;
  int wrong = 0;
};

Counts print_row(const std::string& name, const std::vector<Cell>& cells,
                 const std::function<bool(const Cell&)>& which) {
  Counts counts;
  for (const Cell& cell : cells) {
    if (!which(cell)) continue;
    ++counts.all;
    counts.below += cell.f1 < kGoal_percent ? 1 : 0;
    counts.unsaid += cell.unsaid ? 1 : 0;
    counts.wrong += cell.wrong ? 1 : 0;
  }
  fmt::print("| {} | {} | {} | {} | {} |\n", name, counts.all, counts.below, counts.unsaid, counts.wrong);
  return counts;
}

}  // namespace

bool print_made(int draws, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::vector<Cell> cells;
  for (int i = 0; i < draws; ++i) cells.push_back(judged(draw_lead(generator)));
  fmt::print(
      "| leads | drawn | F1 below {:g} % | of these neither noise nor doubt said of as many beats as are wrong | "
      "more than 2 % false beats above {:g} |\n|---|---|---|---|---|\n",
      kGoal_percent, MadeOutcome::kWrong);
  const auto plain = [](const Cell& c) { return c.plain; };
  const auto among_plain = [&](const std::string& name, const std::function<bool(const MadeLeadSettings&)>& which) {
    print_row(name, cells, [&](const Cell& c) { return c.plain && which(c.settings); });
  };
  const Counts plain_ones = print_row("P and T below 1.2 R, QRS the narrowest", cells, plain);
  among_plain("these, 2:1 block", [](const auto& s) { return s.block; });
  among_plain("without block", [](const auto& s) { return !s.block; });
  among_plain("without block, noise below 0.05 mV", [](const auto& s) { return !s.block && s.noise_mV < 0.05; });
  among_plain("0.05 to 0.1 mV", [](const auto& s) { return !s.block && s.noise_mV >= 0.05 && s.noise_mV < 0.1; });
  among_plain("0.1 to 0.2 mV", [](const auto& s) { return !s.block && s.noise_mV >= 0.1; });
  among_plain("paced, without block",
              [](const auto& s) { return !s.block && (s.atrial_spikes || s.ventricular_spikes); });
  among_plain("100 and 125 Hz, without block", [](const auto& s) { return !s.block && s.rate_hz < 150.0; });
  among_plain("P above 0.5 R, without block", [](const auto& s) { return !s.block && s.p > 0.5; });
  among_plain("above 150 a minute", [](const auto& s) { return !s.block && s.per_minute > 150.0; });
  const Counts others =
      print_row("P or T higher, or another wave as narrow", cells, [](const Cell& c) { return !c.plain; });
  for (const Cell& cell : cells) {
    if ((cell.plain && cell.f1 < kGoal_percent) || cell.wrong) {
      fmt::print(stderr, "{} F1 {:.1f}{}: {}\n", cell.plain ? "plain" : "other", cell.f1, cell.wrong ? " wrong" : "",
                 cell.settings.text());
    }
  }
  return plain_ones.below <= kMostBelow * plain_ones.all + kByChance &&
         plain_ones.wrong <= kMostPlainWrong * plain_ones.all + kByChance &&
         others.wrong <= kMostOthersWrong * others.all + kByChance;
}

}  // namespace perimap::test
