// What process noise by evidence is for: a motion whose amplitude changes while the filter knows it ever better.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "core/estimation/feature_health.hpp"
#include "daemon/evaluation/experiment/accuracy_figures.hpp"
#include "daemon/evaluation/experiment/method.hpp"
#include "goals.hpp"

namespace perimap::test {
namespace {

constexpr double kMinutes = 2.0;

enum class ProcessNoise : std::uint8_t { kNone, kAlways, kByEvidence };

struct Outcome {
  std::vector<double> errors_mm;
  double nees = 0.0;
  int inflated = 0;
  int started_anew = 0;
  int without_map = 0;  // features at the end

  [[nodiscard]] double median_mm() const { return quantile(errors_mm, 0.5); }
  [[nodiscard]] double mean_nees() const { return nees / static_cast<double>(errors_mm.size()); }
};

// Started as the delayed method does, then as the pipeline learns: update, health and what it asks for, noise for the
// time that has passed. Without evidence there is the update alone, with noise always or never.
void follow(const Scene& scene, const SceneFeature& feature, ProcessNoise noise, Outcome& outcome) {
  const BasisLayout layout;
  const auto new_start = [&] {
    return make_method(MethodKind::kDelayed, {&scene, layout, Prior{}, scene.settings.distance_mm});
  };
  const auto& model = std::get<PixelModel>(scene.model);
  auto start = new_start();
  FeatureEstimate estimate;
  FeatureHealth health;
  bool mapped = false;
  double last_s = 0.0;
  for (const Sighting& sighting : feature.sightings) {
    const SceneFrame& frame = scene.frames[static_cast<std::size_t>(sighting.frame)];
    if (!mapped) {
      start->observe(sighting);
      mapped = start->estimate() != nullptr;
      if (mapped) estimate = *start->estimate();
      last_s = frame.time_s;
      continue;
    }
    const Basis b = frame.basis(layout);
    const UpdateOutcome update =
        iterated_update(estimate, observation_of(scene, layout, sighting, estimate.position(b)), model, {});
    constexpr double kAlways_mm = 0.01;
    double density = noise == ProcessNoise::kAlways ? kAlways_mm : 0.0;
    if (noise == ProcessNoise::kByEvidence) {
      const HealthAction action = health.add(update.normalised_innovation_squared, update.accepted);
      if (action == HealthAction::kStartAnew) {
        ++outcome.started_anew;
        start = new_start();
        health.reset();
        mapped = false;
        continue;
      }
      if (action == HealthAction::kInflate) {
        ++outcome.inflated;
        diffuse(estimate, layout, kInflation_mm);
      }
      density = health.process_noise();
    }
    if (density > 0.0) diffuse(estimate, layout, density * std::sqrt(frame.time_s - last_s));
    last_s = frame.time_s;
  }
  if (!mapped) {
    ++outcome.without_map;
    return;
  }
  const SceneFeature now = scene.drifted(feature, last_s);
  outcome.errors_mm.push_back(path_error_mm(estimate, layout, scene, now));
  outcome.nees += normalised_squared_error(estimate, layout, scene, now);
}

}  // namespace

void motion_that_drifts(const Extent& extent, const HeartMesh& heart, GoalReport& report) {
  const int trials = extent.whole ? 40 : 4;
  Outcome outcomes[2][3];
  for (int trial = 0; trial < trials; ++trial) {
    for (const int drifts : {0, 1}) {
      SceneSettings settings;
      settings.seed = 400'000 * extent.seed + static_cast<std::uint64_t>(trial);
      settings.frames = static_cast<int>(kMinutes * 60.0 * settings.frames_per_s);
      settings.drift_per_min = drifts != 0 ? 0.2 : 0.0;
      const auto scene = make_scene(settings, heart);
      if (!scene) throw std::runtime_error(scene.error().message);
      for (const SceneFeature& feature : scene->features) {
        for (const ProcessNoise noise : {ProcessNoise::kNone, ProcessNoise::kAlways, ProcessNoise::kByEvidence})
          follow(*scene, feature, noise, outcomes[drifts][static_cast<int>(noise)]);
      }
    }
  }
  const auto& [still, drifting] = outcomes;
  const auto none = static_cast<int>(ProcessNoise::kNone);
  const auto always = static_cast<int>(ProcessNoise::kAlways);
  const auto evidence = static_cast<int>(ProcessNoise::kByEvidence);
  for (const auto& [name, outcome] : {std::pair{"drift of 20 %/min, no process noise", &drifting[none]},
                                      {"drift of 20 %/min, always .01 mm/sqrt(s)", &drifting[always]},
                                      {"no drift, no process noise", &still[none]},
                                      {"no drift, always .01 mm/sqrt(s)", &still[always]}}) {
    report.shown(fmt::format("{}: median (mm)", name), "", outcome->median_mm());
    report.shown("  NEES/3", "", outcome->mean_nees());
  }
  report.shown("drift of 20 %/min, by evidence: median (mm)", "", drifting[evidence].median_mm());
  report.shown("  inflated", "", drifting[evidence].inflated);
  report.shown("  started anew", "", drifting[evidence].started_anew);
  report.shown("  without a map at the end", "", drifting[evidence].without_map);
  report.at_most("  NEES/3", 1.5, drifting[evidence].mean_nees());
  report.at_most("  over always .01 mm/sqrt(s)", 1.0, drifting[evidence].median_mm() / drifting[always].median_mm());
  report.at_most("  over no process noise", 0.3, drifting[evidence].median_mm() / drifting[none].median_mm());
  report.at_most("no drift, by evidence, over no process noise: median", 1.05,
                 still[evidence].median_mm() / still[none].median_mm());
  report.shown("  inflated", "", still[evidence].inflated);
  report.within("  NEES/3", 0.9, 1.1, still[evidence].mean_nees());
}

}  // namespace perimap::test
