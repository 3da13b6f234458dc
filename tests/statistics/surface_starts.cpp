// What a map gives to a feature that is seen for the first time: its start from the surface through the others, beside
// that from its own prior.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include "core/surface/periodic_surface.hpp"
#include "core/surface/surface_start.hpp"
#include "daemon/evaluation/experiment/accuracy_figures.hpp"
#include "daemon/evaluation/experiment/method.hpp"
#include "daemon/evaluation/experiment/shared_map.hpp"
#include "goals.hpp"

namespace perimap::test {
namespace {

constexpr std::size_t kMapped = 50;
constexpr std::size_t kNew = 16;
constexpr int kDrawn = 240;      // of which enough are seen
constexpr int kFirstSeen = 600;  // frame: 20 s of a map
constexpr std::array<int, 3> kSeconds = {1, 2, 5};
constexpr std::array<double, 3> kRatios = {0.35, 0.4, 0.65};
constexpr double kConverged_mm = 1.0;
constexpr int kFrames_per_s = 30;
constexpr double kMatch_px = 0.1;  // as patches are matched to in pictures

struct Side {
  std::array<std::vector<double>, kSeconds.size()> errors_mm;
  std::array<std::vector<double>, kSeconds.size()> nees;
  std::vector<double> converged_s;

  void add(std::size_t at, const FeatureEstimate& estimate, const Scene& scene, const SceneFeature& feature) {
    errors_mm[at].push_back(path_error_mm(estimate, BasisLayout{}, scene, feature));
    nees[at].push_back(normalised_squared_error(estimate, BasisLayout{}, scene, feature));
  }
};

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

// Something of the heart lies before it: a scene's features are seen all the same.
bool is_hidden(const SceneFeature& feature, const Vector3d& axis_W, const BasisLayout& layout, const HeartMesh& heart) {
  constexpr double kBeside_mm = 4.0;
  constexpr double kBefore_mm = 5.0;
  const Eigen::Index n = layout.size();
  const Vector3d p(feature.x(0), feature.x(n), feature.x(2 * n));
  for (Eigen::Index vertex = 0; vertex < static_cast<Eigen::Index>(heart.vertex_count); ++vertex) {
    const double* c = heart.coefficients_mm.data() + 3 * n * vertex;
    const Vector3d d = Vector3d(c[0], c[n], c[2 * n]) - p;
    const double along = d.dot(axis_W);
    if (along < -kBefore_mm && (d - along * axis_W).norm() < kBeside_mm) return true;
  }
  return false;
}

Scene scene_of(const Extent& extent, const HeartMesh& heart, int trial, double tracker_mm) {
  SceneSettings settings;
  settings.surface = SceneSurface::kHeart;
  settings.deviation = kMatch_px;
  settings.seed = 700'000 * extent.seed + static_cast<std::uint64_t>(trial);
  settings.features = kDrawn;
  settings.frames = kFirstSeen + 10 * kFrames_per_s;
  if (tracker_mm > 0.0) settings.pose_error = {tracker_mm, 0.5 * std::numbers::pi / 180.0, 0.0};
  auto scene = make_scene(settings, heart);
  if (!scene) throw std::runtime_error(scene.error().message);
  // Points are drawn with replacement: a new one is not to be a mapped one.
  std::vector<SceneFeature> chosen;
  for (const SceneFeature& feature : scene->features) {
    const bool again = std::any_of(chosen.begin(), chosen.end(),
                                   [&feature](const SceneFeature& other) { return other.x == feature.x; });
    if (!again && !is_hidden(feature, scene->axis_W, scene->layout, heart)) chosen.push_back(feature);
  }
  scene->features = std::move(chosen);
  if (scene->features.size() < kMapped + kNew) throw std::runtime_error("too few features are seen");
  scene->features.resize(kMapped + kNew);
  return *std::move(scene);
}

PeriodicSurface surface_of(const Scene& scene) {
  SharedMap map(scene, BasisLayout{}, Prior{}, PoseUse::kTrackerAlone);
  map.advance(kFirstSeen);
  std::vector<SurfaceEvidence> evidence;
  for (std::size_t i = 0; i < kMapped; ++i) {
    if (!map.estimate(i) || largest_deviation_mm(*map.estimate(i), BasisLayout{}) > kConverged_mm) continue;
    evidence.push_back(surface_evidence(static_cast<std::uint32_t>(i + 1), BasisLayout{}, *map.estimate(i)));
  }
  Vector3d camera_W = Vector3d::Zero();
  for (int f = 0; f < kFirstSeen; ++f) camera_W += scene.frames[static_cast<std::size_t>(f)].X_CW.inverse().t;
  auto surface = PeriodicSurface::fit(BasisLayout{}, evidence, camera_W / kFirstSeen);
  if (!surface) throw std::runtime_error(surface.error().message);
  return *std::move(surface);
}

// Of the first matches since kFirstSeen.
std::vector<Observation> observations_of(const Scene& scene, const SceneFeature& feature) {
  std::vector<Observation> observations;
  for (const Sighting& sighting : feature.sightings) {
    if (sighting.frame < kFirstSeen) continue;
    const Pose X_WC = scene.frames[static_cast<std::size_t>(sighting.frame)].X_CW.inverse();
    Vector3d ray_C = Vector3d::UnitZ();
    static_cast<void>(std::get<PixelModel>(scene.model).ray(sighting.z, ray_C));
    observations.push_back(observation_of(scene, BasisLayout{}, sighting, X_WC * (scene.settings.distance_mm * ray_C)));
  }
  return observations;
}

struct Trial {
  Side own;
  Side from_surface;
  int features = 0;
  int not_there = 0;
  int contradicts = 0;
};

void try_feature(const Scene& scene, const PeriodicSurface& surface, const SceneFeature& feature, Trial& trial) {
  const auto& model = std::get<PixelModel>(scene.model);
  const std::vector<Observation> all = observations_of(scene, feature);
  if (all.size() < 10 * kFrames_per_s) return;
  ++trial.features;
  const auto first = [&all](int count) { return std::span(all).first(static_cast<std::size_t>(count)); };
  const SurfaceStart start = start_on_surface(surface, first(kFrames_per_s), model);
  trial.not_there += start.kind == SurfaceStartKind::kNotThere ? 1 : 0;
  trial.contradicts += start.kind == SurfaceStartKind::kContradicts ? 1 : 0;
  if (start.kind != SurfaceStartKind::kStarted) return;
  for (std::size_t at = 0; at < kSeconds.size(); ++at) {
    const auto matches = first(kSeconds[at] * kFrames_per_s);
    const BatchOutcome own = batch_start(matches, model, BasisLayout{}, Prior{});
    const SurfaceStart there = start_on_surface(surface, matches, model);
    if (!own.ok() || !there.outcome.ok()) continue;
    trial.own.add(at, own.estimate, scene, feature);
    trial.from_surface.add(at, there.outcome.estimate, scene, feature);
  }
  const auto converged = [&](const auto& solve) {
    for (int count = 10; count <= 10 * kFrames_per_s; count += 10) {
      const BatchOutcome outcome = solve(first(count));
      if (outcome.ok() && largest_deviation_mm(outcome.estimate, BasisLayout{}) <= kConverged_mm) {
        return static_cast<double>(count) / kFrames_per_s;
      }
    }
    return static_cast<double>(INFINITY);
  };
  trial.own.converged_s.push_back(
      converged([&](auto matches) { return batch_start(matches, model, BasisLayout{}, Prior{}); }));
  trial.from_surface.converged_s.push_back(
      converged([&](auto matches) { return start_on_surface(surface, matches, model).outcome; }));
}

}  // namespace

void starts_on_the_surface(const Extent& extent, const HeartMesh& heart, GoalReport& report) {
  const int trials = extent.whole ? 12 : 2;
  for (const double tracker_mm : {0.0, 1.4}) {
    Trial all;
    for (int trial = 0; trial < trials; ++trial) {
      const Scene scene = scene_of(extent, heart, trial, tracker_mm);
      const PeriodicSurface surface = surface_of(scene);
      for (std::size_t i = kMapped; i < scene.features.size(); ++i) {
        try_feature(scene, surface, scene.features[i], all);
      }
    }
    const std::string tracker = tracker_mm > 0.0 ? fmt::format("{} mm", tracker_mm) : "exact";
    report.shown(fmt::format("{} tracker: features", tracker), "", all.features);
    report.shown("  beside the surface", "", all.not_there);
    report.at_most("  contradicted", 0.05 * all.features, all.contradicts);
    for (std::size_t at = 0; at < kSeconds.size(); ++at) {
      const double own = quantile(all.own.errors_mm[at], 0.5);
      const double there = quantile(all.from_surface.errors_mm[at], 0.5);
      report.shown(fmt::format("  {} s, own prior: median path error (mm)", kSeconds[at]), "", own);
      report.shown("    from the surface", "", there);
      // A feature that is seen for long knows by itself, and is to be none the worse.
      if (at == 0) {
        report.at_most("    beside the own prior", kRatios[at], there / own);
      } else {
        report.shown("    beside the own prior", fmt::format("({:g})", kRatios[at]), there / own);
        report.at_most("      not above it by more than a twentieth", 1.05, there / own);
      }
      report.shown("    95 %, own prior / from the surface (mm)", "", quantile(all.own.errors_mm[at], 0.95),
                   quantile(all.from_surface.errors_mm[at], 0.95));
      report.at_most("    NEES/3", 1.5, mean(all.from_surface.nees[at]));
      report.shown("      median", "", quantile(all.from_surface.nees[at], 0.5));
      report.shown("      own prior", "", mean(all.own.nees[at]));
    }
    report.shown("  deviation below 1 mm after, own prior (s)", "", quantile(all.own.converged_s, 0.5));
    report.shown("    from the surface", "", quantile(all.from_surface.converged_s, 0.5));
  }
}

}  // namespace perimap::test
