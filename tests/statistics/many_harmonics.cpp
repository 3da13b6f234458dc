// What the shipped number of harmonics is for: a motion that has more of them than the state.
#include <cmath>
#include <stdexcept>
#include <vector>

#include "daemon/evaluation/experiment/accuracy_figures.hpp"
#include "daemon/evaluation/experiment/method.hpp"
#include "goals.hpp"

namespace perimap::test {
namespace {

constexpr double kFirstDepth_mm = 90.0;
constexpr int kSeconds = 60;
constexpr int kHarmonics[] = {3, 5, 8, 10, kMaxHarmonics};
constexpr std::size_t kStates = std::size(kHarmonics);

struct Outcome {
  std::vector<double> errors_mm;
  double nees = 0.0;

  [[nodiscard]] double median_mm() const { return quantile(errors_mm, 0.5); }
  [[nodiscard]] double mean_nees() const { return nees / static_cast<double>(errors_mm.size()); }
};

void follow(const Scene& scene, const SceneFeature& feature, const BasisLayout& layout, Outcome& outcome) {
  const auto method = make_method(MethodKind::kDelayed, {&scene, layout, Prior{}, kFirstDepth_mm});
  for (const Sighting& sighting : feature.sightings) method->observe(sighting);
  const FeatureEstimate* estimate = method->estimate();
  if (estimate == nullptr) {
    outcome.errors_mm.push_back(INFINITY);
    return;
  }
  outcome.errors_mm.push_back(path_error_mm(*estimate, layout, scene, feature));
  outcome.nees += normalised_squared_error(*estimate, layout, scene, feature);
}

}  // namespace

void motion_with_many_harmonics(const Extent& extent, const HeartMesh& heart, GoalReport& report) {
  const int trials = extent.whole ? 40 : 8;
  Outcome outcomes[kStates];
  for (int trial = 0; trial < trials; ++trial) {
    SceneSettings settings;
    settings.seed = 600'000 * extent.seed + static_cast<std::uint64_t>(trial);
    settings.ellipsoid_harmonics = kMaxHarmonics;
    settings.frames = static_cast<int>(kSeconds * settings.frames_per_s);
    const auto scene = make_scene(settings, heart);
    if (!scene) throw std::runtime_error(scene.error().message);
    for (const SceneFeature& feature : scene->features) {
      // Some leave the picture.
      if (static_cast<double>(feature.sightings.size()) < 0.6 * settings.frames) continue;
      for (std::size_t i = 0; i < kStates; ++i) follow(*scene, feature, {kHarmonics[i], 0}, outcomes[i]);
    }
  }
  for (std::size_t i = 0; i < kStates; ++i) {
    report.shown(fmt::format("truth of {} harmonics, {} s, H = {}: median of {} (mm)", kMaxHarmonics, kSeconds,
                             kHarmonics[i], outcomes[i].errors_mm.size()),
                 "", outcomes[i].median_mm());
    // A covariance knows nothing of harmonics that the state lacks.
    if (kHarmonics[i] < kMaxHarmonics) {
      report.shown("  NEES/3", "", outcomes[i].mean_nees());
    } else {
      report.within("  NEES/3", 0.9, 1.1, outcomes[i].mean_nees());
    }
    if (i == 0) continue;
    report.at_most(fmt::format("  over H = {}", kHarmonics[i - 1]), 0.8,
                   outcomes[i].median_mm() / outcomes[i - 1].median_mm());
  }
}

}  // namespace perimap::test
