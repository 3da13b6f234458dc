// The Monte Carlo programme: how good the estimator, the ECG side and the prediction are, beside what was to be
// reached. Exit code 1 when a goal that can be reached is missed.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <map>
#include <string>
#include <vector>

#include "daemon/evaluation/experiment/scene.hpp"
#include "goals.hpp"

int main(int argc, char** argv) {
  using perimap::test::Extent;
  using perimap::test::GoalReport;
  using perimap::test::HorizonScenes;
  using Goal = void (*)(const Extent&, const perimap::HeartMesh&, GoalReport&);
  const std::map<std::string, Goal> goals{{"lost", perimap::test::no_feature_is_lost},
                                          {"optimal", perimap::test::as_exact_as_the_data_allow},
                                          {"drift", perimap::test::motion_that_drifts},
                                          {"breath", perimap::test::motion_that_breathes},
                                          {"harmonics", perimap::test::motion_with_many_harmonics},
                                          {"pose", perimap::test::pose_errors},
                                          {"late", perimap::test::learning_late},
                                          {"surface", perimap::test::starts_on_the_surface},
                                          {"ecg", perimap::test::beats_under_disturbances},
                                          {"horizons", perimap::test::displayed_ahead},
                                          {"ventilated", perimap::test::ventilated}};
  CLI::App app(
      "Monte Carlo statistics of the estimator, with known phase and association, of the ECG side, "
      "and of what the whole pipeline displays");
  Extent extent;
  std::vector<std::string> chosen;
  app.add_option("GOALS", chosen,
                 "lost, optimal, drift, breath, harmonics, pose, late, surface, ecg, horizons, ventilated; all when "
                 "none is named")
      ->check(CLI::IsMember({"lost", "optimal", "drift", "breath", "harmonics", "pose", "late", "surface", "ecg",
                             "horizons", "ventilated"}));
  app.add_flag("--long", extent.whole, "As many trials as the figures in docs/evidence");
  app.add_option("--seed", extent.seed, "Another seed, other trials")->capture_default_str();
  HorizonScenes& scenes = extent.horizons;
  const std::map<std::string, perimap::MotionLaw> laws{{"linear", perimap::MotionLaw::kLinear},
                                                       {"warped", perimap::MotionLaw::kWarped},
                                                       {"time-locked", perimap::MotionLaw::kTimeLocked}};
  std::vector<std::string> law_names;
  app.add_option("--record", scenes.records, "horizons: these ECG records");
  app.add_option("--law", law_names, "horizons: these motion laws (linear, warped, time-locked)")
      ->check(CLI::IsMember(laws));
  app.add_option("--width", scenes.width, "horizons: of the pictures, px")->capture_default_str();
  app.add_option("--height", scenes.height, "horizons: of the pictures, px")->capture_default_str();
  app.add_option("--duration", scenes.duration_s, "horizons: s");
  CLI11_PARSE(app, argc, argv);
  for (const std::string& name : law_names) scenes.laws.push_back(laws.at(name));
  if (chosen.empty())
    chosen = {"lost", "optimal", "drift", "breath",   "harmonics", "pose",
              "late", "surface", "ecg",   "horizons", "ventilated"};
  try {
    const auto heart = perimap::load_heart();
    if (!heart) throw std::runtime_error(heart.error().message);
    GoalReport report;
    for (const std::string& name : chosen) goals.at(name)(extent, *heart, report);
    return report.failed() == 0 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "statistics: %s\n", error.what());
    return 1;
  }
}
