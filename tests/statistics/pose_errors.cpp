// Goals with errors of the camera pose, which all matches of a frame share.
#include <algorithm>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "daemon/experiment/accuracy_figures.hpp"
#include "daemon/experiment/shared_map.hpp"
#include "goals.hpp"

namespace perimap::test {
namespace {

// Errors are compared by their medians, so bounds are too: by the median of errors that have the bound as covariance.
void draw_errors(std::vector<double>& errors_mm, const FeatureEstimate& bound) {
  constexpr int kDraws = 20;
  const auto drawn = drawn_path_errors_mm(bound, BasisLayout{}, kDraws, errors_mm.size());
  errors_mm.insert(errors_mm.end(), drawn.begin(), drawn.end());
}

struct Sums {
  std::vector<double> errors_mm;
  double nees = 0.0;
  double published_nees = 0.0;
  std::vector<double> bounds_mm;  // path errors of an estimator of each feature alone that reaches its bound

  void add(const Scene& scene, const SharedMap& map, int end_frame, bool tracker_alone) {
    const BasisLayout layout;
    for (std::size_t i = 0; i < map.size(); ++i) {
      if (!map.estimate(i)) continue;
      const SceneFeature& feature = scene.features[i];
      errors_mm.push_back(path_error_mm(*map.estimate(i), layout, scene, feature));
      nees += normalised_squared_error(*map.estimate(i), layout, scene, feature);
      if (!tracker_alone) continue;
      published_nees += normalised_squared_error(map.published(i), layout, scene, feature);
      draw_errors(bounds_mm, cramer_rao_bound(scene, feature, layout, Prior{}, end_frame));
    }
  }
  [[nodiscard]] double count() const { return static_cast<double>(errors_mm.size()); }
};

constexpr int kChecks = 3;
constexpr double kSeconds[kChecks] = {5.0, 20.0, 40.0};
constexpr double kLimits_mm[kChecks] = {1.05, 0.50, 0.35};

int frame_at(double seconds) { return static_cast<int>(30.0 * seconds); }

Scene scene_of(const Extent& extent, const HeartMesh& heart, int trial, double correlation_s, int frames) {
  SceneSettings settings;
  settings.seed = 300'000 * extent.seed + static_cast<std::uint64_t>(trial);
  settings.features = 24;
  settings.frames = frames;
  settings.pose_error = {1.4, 0.5 * std::numbers::pi / 180.0, correlation_s};
  auto scene = make_scene(settings, heart);
  if (!scene) throw std::runtime_error(scene.error().message);
  return *std::move(scene);
}

// Independent priors of many features say that their mean motion is small, which no heart's is. With this one the mean
// is as free as each feature is with the plain prior.
Prior in_common_prior(const Scene& scene) {
  Prior prior;
  const double wider = std::sqrt(static_cast<double>(scene.features.size()));
  prior.dc_mm *= wider;
  prior.cardiac_mm *= wider;
  return prior;
}

std::string title(double correlation_s, const char* name, int at) {
  const std::string kind = correlation_s == 0.0 ? "white" : fmt::format("{} s", correlation_s);
  return fmt::format("pose error {}, {}, {} s: median (mm)", kind, name, kSeconds[at]);
}

}  // namespace

void pose_errors(const Extent& extent, const HeartMesh& heart, GoalReport& report) {
  // The features of a trial share the poses' errors, so trials count, not features.
  const int trials = extent.whole ? 60 : 8;
  const int shared_trials = extent.whole ? 10 : 1;
  const int bound_trials = extent.whole ? 3 : 1;
  const int checks = extent.whole ? kChecks : 2;
  for (const double correlation_s : {0.0, 0.5, 5.0}) {
    Sums alone[kChecks];
    Sums naive[kChecks];
    Sums others[kChecks];
    std::vector<double> joint_bounds_mm[kChecks];
    std::vector<double> in_common_bounds_mm[kChecks];
    for (int trial = 0; trial < trials; ++trial) {
      const Scene scene = scene_of(extent, heart, trial, correlation_s, frame_at(kSeconds[checks - 1]));
      const auto follow = [&](PoseUse use, Sums* sums) {
        SharedMap map(scene, BasisLayout{}, Prior{}, use);
        for (int at = 0; at < checks; ++at) {
          map.advance(frame_at(kSeconds[at]));
          sums[at].add(scene, map, frame_at(kSeconds[at]), use == PoseUse::kTrackerAlone);
        }
      };
      follow(PoseUse::kTrackerAlone, alone);
      if (trial < shared_trials) {
        follow(PoseUse::kSharedNaive, naive);
        follow(PoseUse::kSharedOthers, others);
      }
      if (trial >= bound_trials) continue;
      for (int at = 0; at < checks; ++at) {
        for (const FeatureEstimate& one : joint_cramer_rao_bound(scene, BasisLayout{}, Prior{}, frame_at(kSeconds[at])))
          draw_errors(joint_bounds_mm[at], one);
        for (const FeatureEstimate& one :
             joint_cramer_rao_bound(scene, BasisLayout{}, in_common_prior(scene), frame_at(kSeconds[at])))
          draw_errors(in_common_bounds_mm[at], one);
      }
    }
    const bool white = correlation_s == 0.0;
    for (int at = 0; at < checks; ++at) {
      const double joint_bound = quantile(joint_bounds_mm[at], 0.5);
      const double reached = quantile(alone[at].errors_mm, 0.5);
      const double own_bound = quantile(alone[at].bounds_mm, 0.5);
      // Where the bound of features taken one by one is above the goal, no estimator of such features can meet it; what
      // it can be asked then is to be at the bound.
      if (white) {
        report.shown(title(correlation_s, "tracker alone", at), fmt::format("<= {:g}", kLimits_mm[at]), reached,
                     own_bound);
        report.at_most("  over the goal, or where that is less the bound of each alone", extent.whole ? 1.1 : 1.2,
                       reached / std::max(kLimits_mm[at], own_bound));
      } else {
        report.shown(title(correlation_s, "tracker alone", at), "", reached, joint_bound);
      }
      report.shown("  NEES/3", "", alone[at].nees / alone[at].count());
      report.at_most("  NEES/3 of the published covariance, common part counted in", 1.5,
                     alone[at].published_nees / alone[at].count());
      const std::string half = white ? fmt::format("<= {:g}", 0.5 * kLimits_mm[at]) : "";
      for (const auto& [name, sums] : {std::pair{"shared, counted twice", naive}, {"shared, from others", others}}) {
        report.shown(title(correlation_s, name, at), half, quantile(sums[at].errors_mm, 0.5), joint_bound);
        report.shown("  NEES/3", "", sums[at].nees / sums[at].count());
      }
      report.shown("  joint bound where the mean motion is free", "", quantile(in_common_bounds_mm[at], 0.5));
    }
  }
}

}  // namespace perimap::test
