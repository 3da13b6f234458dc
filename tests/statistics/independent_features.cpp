// Goals of features that have nothing in common.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "daemon/evaluation/experiment/accuracy_figures.hpp"
#include "daemon/evaluation/experiment/comparison.hpp"
#include "daemon/evaluation/experiment/method.hpp"
#include "goals.hpp"

namespace perimap::test {
namespace {

constexpr double kBearingDeviation_rad = 0.2 * std::numbers::pi / 180.0;

Scene scene_of(const SceneSettings& settings, const HeartMesh& heart) {
  auto scene = make_scene(settings, heart);
  if (!scene) throw std::runtime_error(scene.error().message);
  return *std::move(scene);
}

// The estimate after every sighting; its error is infinite where there is none.
struct Outcome {
  double error_mm = INFINITY;
  double nees = NAN;
};

Outcome outcome_of(MethodKind kind, const Scene& scene, const SceneFeature& feature, double first_depth_mm,
                   const MethodOptions& options = {}) {
  const auto method = make_method(kind, {&scene, BasisLayout{}, Prior{}, first_depth_mm}, options);
  for (const Sighting& sighting : feature.sightings) method->observe(sighting);
  const FeatureEstimate* estimate = method->estimate();
  if (estimate == nullptr) return {};
  return {path_error_mm(*estimate, method->layout(), scene, feature),
          normalised_squared_error(*estimate, method->layout(), scene, feature)};
}

}  // namespace

void no_feature_is_lost(const Extent& extent, const HeartMesh& heart, GoalReport& report) {
  const int trials = extent.whole ? 200 : 30;
  constexpr int kFeatures = 5;
  constexpr double kFactors[] = {0.35, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0};
  for (const double outliers : {0.0, 0.1}) {
    int all = 0;
    int all_lost = 0;
    for (const double factor : kFactors) {
      int features = 0;
      int lost = 0;
      double worst = 0.0;
      for (int trial = 0; trial < trials; ++trial) {
        SceneSettings settings;
        settings.seed = 100'000 * extent.seed + static_cast<std::uint64_t>(trial);
        settings.features = kFeatures;
        settings.frames = 300;
        settings.outliers = outliers;
        // Half of the trials are of either kind.
        settings.bearings = trial % 2 == 1;
        if (settings.bearings) settings.deviation = kBearingDeviation_rad;
        const Scene scene = scene_of(settings, heart);
        for (const SceneFeature& feature : scene.features) {
          if (feature.sightings.size() < 200) continue;
          const double depth_mm = factor * true_first_depth_mm(scene, feature);
          const double error = outcome_of(MethodKind::kDelayed, scene, feature, depth_mm).error_mm;
          ++features;
          lost += error > kLostError_mm ? 1 : 0;
          worst = std::max(worst, error);
        }
      }
      report.shown(fmt::format("  start depth {} x true, {:.0f} % outliers: worst error of {} (mm)", factor,
                               100 * outliers, features),
                   "", worst);
      all += features;
      all_lost += lost;
    }
    report.at_most(
        fmt::format("features above 2 mm of {}, depth 0.35-3 x true, {:.0f} % outliers", all, 100 * outliers), 0.0,
        all_lost);
  }
}

void as_exact_as_the_data_allow(const Extent& extent, const HeartMesh& heart, GoalReport& report) {
  const int trials = extent.whole ? 100 : 16;
  struct Case {
    const char* name;
    SceneSurface surface;
    bool bearings;
    double outliers;
    double median_limit;
    double p99_limit;
  };
  const Case cases[] = {{"ellipsoid, pixels", SceneSurface::kEllipsoid, false, 0.0, 1.005, 1.02},
                        {"heart, bearings", SceneSurface::kHeart, true, 0.0, 1.005, 1.02},
                        {"ellipsoid, pixels, 5 % outliers", SceneSurface::kEllipsoid, false, 0.05, 1.05, NAN},
                        {"ellipsoid, pixels, 10 % outliers", SceneSurface::kEllipsoid, false, 0.10, 1.10, NAN}};
  for (const Case& one : cases) {
    std::vector<double> ratios;
    double squared_error = 0.0;
    double squared_bound = 0.0;
    double nees = 0.0;
    for (int trial = 0; trial < trials; ++trial) {
      SceneSettings settings;
      settings.seed = 200'000 * extent.seed + static_cast<std::uint64_t>(trial);
      settings.surface = one.surface;
      settings.bearings = one.bearings;
      if (settings.bearings) settings.deviation = kBearingDeviation_rad;
      settings.outliers = one.outliers;
      settings.frames = 600;
      const Scene scene = scene_of(settings, heart);
      constexpr double kFirstDepth_mm = 90.0;
      MethodOptions good;
      good.only_good = true;
      for (const SceneFeature& feature : scene.features) {
        if (feature.sightings.size() < 400) continue;
        const Outcome ours = outcome_of(MethodKind::kDelayed, scene, feature, kFirstDepth_mm);
        const Outcome batch = outcome_of(MethodKind::kBatch, scene, feature, kFirstDepth_mm, good);
        const FeatureEstimate bound = cramer_rao_bound(scene, feature, BasisLayout{}, Prior{}, settings.frames);
        ratios.push_back(ours.error_mm / batch.error_mm);
        squared_error += ours.error_mm * ours.error_mm;
        squared_bound += std::pow(path_deviation_mm(bound, BasisLayout{}), 2);
        nees += ours.nees;
      }
    }
    const std::string name = one.name;
    const double count = static_cast<double>(ratios.size());
    report.at_most(fmt::format("{}, 20 s: error / batch MAP, median of {}", name, ratios.size()), one.median_limit,
                   quantile(ratios, 0.5));
    // Of fewer than a few hundred features the 99th percentile is the worst of them, which says little.
    if (extent.whole && !std::isnan(one.p99_limit)) {
      report.at_most("  99th percentile", one.p99_limit, quantile(ratios, 0.99));
    } else {
      report.shown("  99th percentile", std::isnan(one.p99_limit) ? "" : fmt::format("({:g})", one.p99_limit),
                   quantile(ratios, 0.99));
    }
    report.at_most("  RMS error / Cramer-Rao bound at H = 8", 1.1, std::sqrt(squared_error / squared_bound), 1.0);
    report.shown("  RMS error (mm)", "", std::sqrt(squared_error / count), std::sqrt(squared_bound / count));
    report.within("  NEES/3, mean over a cycle and features", 0.9, 1.1, nees / count);
  }
}

}  // namespace perimap::test
