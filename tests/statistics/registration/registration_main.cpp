// Preoperative models refined against a surface, over drawn trials: how far off they are at the organ, whether they
// know it, and what becomes of wrong ones. Exit code 1 when a goal is missed.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "core/registration/mesh_check.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/embedded_data.hpp"
#include "goal_report.hpp"
#include "registration_trial.hpp"

namespace perimap::test {
namespace {

double mean(const std::vector<double>& values) {
  return values.empty() ? NAN : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}
double quantile(std::vector<double> values, double share) {
  if (values.empty()) return NAN;
  const auto at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

struct Results {
  int trials = 0, refused = 0, doubted = 0;
  std::vector<double> errors_mm, start_errors_mm, nees, deviations_mm, residuals_mm, expected_mm, told_by_start;
  std::vector<std::string> words;  // the first refusals and doubts
};

struct Scenario {
  TrialSettings trial;
  double declared_mm = 0.0, declared_length_mm = 30.0;
  // Another model in place of the right one.
  std::function<TriangleMesh(const RegistrationTrial&, std::uint64_t)> wrong{};
};

Results run(const HeartMesh& heart, const Scenario& scenario, std::uint64_t seed, int trials) {
  Results results;
  const CounterNoise noise(seed, 4711);
  for (int i = 0; i < trials; ++i) {
    TrialSettings settings = scenario.trial;
    settings.seed = noise.bits(static_cast<std::uint64_t>(i));
    RegistrationTrial trial = registration_trial(heart, settings);
    trial.errors.shape_mm = scenario.declared_mm;
    trial.errors.shape_length_mm = scenario.declared_length_mm;
    ++results.trials;
    const auto checked = check_mesh(scenario.wrong ? scenario.wrong(trial, settings.seed) : trial.model.mesh_I);
    if (!checked) throw std::runtime_error(checked.error().message);
    const auto fit = fit_model(checked->mesh, trial.surface, trial.start, trial.errors);
    const std::string words = !fit ? fit.error().message : fit->doubts.empty() ? "" : "doubted: " + fit->doubts.front();
    if (!words.empty() && results.words.size() < 2) results.words.push_back(words);
    if (!fit) {
      ++results.refused;
      continue;
    }
    if (!fit->doubts.empty()) ++results.doubted;
    const auto off = difference_at(fit->estimate, trial.model.true_X_IW, trial.surface.positions_W_mm);
    const auto start = difference_at(trial.start, trial.model.true_X_IW, trial.surface.positions_W_mm);
    results.errors_mm.push_back(off.rms_mm);
    results.start_errors_mm.push_back(start.rms_mm);
    results.nees.push_back(off.nees);
    results.deviations_mm.push_back(fit->organ_deviation_mm);
    results.residuals_mm.push_back(fit->residual_mm);
    results.expected_mm.push_back(fit->expected_residual_mm);
    results.told_by_start.push_back(fit->told_by_start);
  }
  return results;
}

void show(const Results& results, GoalReport& report) {
  report.shown("  refused, doubted", "", results.refused, results.doubted);
  for (const std::string& words : results.words) fmt::print("    {}\n", words);
  if (results.errors_mm.empty()) return;
  report.shown("  at the organ before: median, largest error (mm)", "", quantile(results.start_errors_mm, 0.5),
               quantile(results.start_errors_mm, 1.0));
  report.shown("  after: median, 95 % (mm)", "", quantile(results.errors_mm, 0.5), quantile(results.errors_mm, 0.95));
  report.shown("  its deviation, median, largest (mm)", "", quantile(results.deviations_mm, 0.5),
               quantile(results.deviations_mm, 1.0));
  report.shown("  residual, expected, medians (mm)", "", quantile(results.residuals_mm, 0.5),
               quantile(results.expected_mm, 0.5));
  report.shown("  directions that the start tells, mean", "", mean(results.told_by_start));
  report.shown("  NEES median, 95 %", "", quantile(results.nees, 0.5), quantile(results.nees, 0.95));
}

TrialSettings trial_with(double shape_mm, double length_mm, double common_mm, std::size_t features) {
  TrialSettings settings;
  settings.seen.features = features;
  settings.seen.common_mm = common_mm;
  settings.model.shape_error_mm = shape_mm;
  settings.model.shape_length_mm = length_mm;
  return settings;
}

void right_models(const HeartMesh& heart, std::uint64_t seed, int trials, GoalReport& report) {
  struct Case {
    const char* name;
    TrialSettings trial;
    double declared_mm;
    std::optional<double> error_goal_mm;
  };
  TrialSettings one_side = trial_with(2.0, 30.0, 0.0, 60);
  one_side.seen.aside_mm = 10.0;
  for (const Case& one : {Case{"exact shape", trial_with(0.0, 30.0, 0.0, 100), 0.0, 1.0},
                          Case{"exact shape, declared 1 mm", trial_with(0.0, 30.0, 0.0, 100), 1.0, std::nullopt},
                          Case{"exact shape, 0.5 mm in common", trial_with(0.0, 30.0, 0.5, 100), 0.0, std::nullopt},
                          Case{"2 mm of shape over 30 mm", trial_with(2.0, 30.0, 0.0, 100), 2.0, std::nullopt},
                          Case{"2 mm of shape over 20 mm", trial_with(2.0, 20.0, 0.0, 100), 2.0, std::nullopt},
                          Case{"2 mm of shape over 45 mm", trial_with(2.0, 45.0, 0.0, 100), 2.0, std::nullopt},
                          Case{"2 mm of shape, 0.5 mm in common", trial_with(2.0, 30.0, 0.5, 100), 2.0, std::nullopt},
                          Case{"2 mm of shape, 60 features on one side", one_side, 2.0, std::nullopt}}) {
    fmt::print("\n{}, {} features\n", one.name, one.trial.seen.features);
    const Results results = run(heart, {one.trial, one.declared_mm, 30.0, {}}, seed, trials);
    show(results, report);
    if (one.error_goal_mm)
      report.at_most("  error at the organ, mean (mm)", *one.error_goal_mm, mean(results.errors_mm));
    report.at_most("  NEES, mean", 1.5, mean(results.nees));
    report.at_most("  refused or doubted, share", 0.05,
                   static_cast<double>(results.refused + results.doubted) / results.trials);
  }
}

void wrong_models(const HeartMesh& heart, std::uint64_t seed, int trials, GoalReport& report) {
  for (const double declared_mm : {0.0, 1.0, 2.0}) {
    for (const auto& [name, wrong] :
         {std::pair("another heart", &another_heart), std::pair("mirrored across the view", &mirrored)}) {
      fmt::print("\n{}, declared {} mm of shape\n", name, declared_mm);
      const Results results =
          run(heart, {trial_with(declared_mm, 30.0, 0.0, 100), declared_mm, 30.0, wrong}, seed, trials);
      show(results, report);
      report.at_least("  refused or doubted, share", 0.9,
                      static_cast<double>(results.refused + results.doubted) / results.trials);
    }
  }
}

int main_with(int argc, char** argv) {
  CLI::App app("Preoperative models refined against a surface, over drawn trials");
  std::uint64_t seed = 1;
  int trials = 8;
  std::vector<std::string> chosen{"right", "wrong"};
  app.add_option("PARTS", chosen, "right, wrong; both when none is named")->check(CLI::IsMember({"right", "wrong"}));
  app.add_option("--seed", seed, "Another seed, other trials")->capture_default_str();
  app.add_option("--trials", trials, "of each case")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const auto heart = parse_heart_mesh(embedded_epicardium_fourier_csv(), embedded_epicardium_faces_csv());
  if (!heart) throw std::runtime_error(heart.error().message);
  GoalReport report;
  for (const std::string& part : chosen) {
    part == "right" ? right_models(*heart, seed, trials, report) : wrong_models(*heart, seed, trials, report);
  }
  return report.failed() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace perimap::test

int main(int argc, char** argv) {
  try {
    return perimap::test::main_with(argc, argv);
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "statistics_registration: %s\n", error.what());
    return 1;
  }
}
