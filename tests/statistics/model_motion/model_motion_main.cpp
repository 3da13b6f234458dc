// What a preoperative model that moves gives to the surface, right and wrong: the motion of its vertices near features,
// beside them and far from them, over drawn trials. Exit code 1 when a goal is missed.
#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "core/surface/periodic_surface.hpp"
#include "core/surface/six_elements.hpp"
#include "drivers/standins/random/counter_noise.hpp"
#include "drivers/standins/simulator/embedded_data.hpp"
#include "drivers/standins/simulator/preoperative.hpp"
#include "goal_report.hpp"
#include "heart_patch.hpp"

namespace perimap::test {
namespace {

constexpr int kPhases = 10;
constexpr double kTurn_rad = 2.0 * std::numbers::pi;
constexpr double kBeside_mm = 40.0;

// A vertex with a feature within the surface's reach, one within 40 mm of one, and any other.
enum Zone : std::size_t { kNear, kBeside, kFar };
constexpr std::array kZoneNames = {"near", "beside", "far"};

struct Figures {
  double square_mm2 = 0.0, claimed_mm2 = 0.0, nees = 0.0;
  double count = 0.0;

  void add(const Eigen::Matrix3Xd& off, const Matrix3d& covariance) {
    // Over the cycle each coefficient counts half.
    square_mm2 += 0.5 * off.rightCols(off.cols() - 1).squaredNorm();
    claimed_mm2 += covariance.trace();
    const Eigen::LDLT<Matrix3d> factor(covariance);
    for (Eigen::Index j = 1; j < off.cols(); ++j) nees += 0.5 * off.col(j).dot(factor.solve(off.col(j))) / 3.0;
    count += 1.0;
  }
  [[nodiscard]] double rms_mm() const { return std::sqrt(square_mm2 / count); }
};

struct Results {
  std::array<Figures, 3> zones;
  double gain = 0.0, turn_rad = 0.0, gain_deviation = 0.0;  // of the first harmonic, sums
  int trials = 0, adopted = 0;                              // the latter: its lowest harmonics are of the model's
};

struct Model {
  const char* name;
  bool is_there = true;
  std::function<void(PreoperativeSettings&)> change{};
  bool right = false;
};

std::shared_ptr<const ModelMotion> motion_of(const HeartMesh& heart, const Model& model, std::uint64_t seed) {
  PreoperativeSettings settings;
  const CounterNoise noise(seed, 5);
  settings.seed = seed;
  settings.phase_rad = noise.uniform(0, 0.0, kTurn_rad);
  settings.shape_error_mm = 1.5;
  settings.off_mm = 1.0;
  settings.off_rad = std::numbers::pi / 180.0;
  std::vector<double> phases = {settings.phase_rad};
  for (int k = 1; k < kPhases; ++k) {
    phases.push_back(settings.phase_rad + k * kTurn_rad / kPhases);
    settings.other_phases_rad.push_back(phases.back());
  }
  if (model.change) model.change(settings);
  PreoperativeModel made = preoperative_model(heart, settings);
  const Pose X_WI = made.start_X_IW.inverse();
  PlacesByPhase vertices = {made.mesh_I.vertices};
  for (TriangleMesh& other : made.others_I) vertices.push_back(std::move(other.vertices));
  for (std::vector<Vector3d>& of_phase : vertices) {
    for (Vector3d& vertex : of_phase) vertex = X_WI * vertex;
  }
  return std::make_shared<const ModelMotion>(phases, vertices, made.mesh_I.triangles);
}

struct Trial {
  HeartPatch patch;
  std::vector<SurfaceEvidence> evidence;
};

Trial trial_of(const HeartMesh& heart, const SeenSettings& seen, std::uint64_t seed) {
  Trial trial;
  trial.patch = patch_of(heart, seen);
  const CounterNoise noise(seed, 4);
  const Vector3d common_W =
      seen.common_mm / std::sqrt(3.0) * Vector3d(noise.normal(0), noise.normal(1), noise.normal(2));
  for (const PlaceHarmonics& c : features_of(heart, trial.patch, seen, seed)) {
    trial.evidence.push_back(
        evidence_of(c, static_cast<std::uint32_t>(trial.evidence.size() + 1), seen, seed, common_W));
  }
  return trial;
}

void judge(const HeartMesh& heart, const PeriodicSurface& surface, bool by_field, Results& results) {
  const auto V = static_cast<Eigen::Index>(heart.vertex_count);
  const OwnHarmonics own = surface.model() != nullptr ? surface.model()->of_vertices() : OwnHarmonics();
  Eigen::Matrix3Xd p(3, V);
  for (Eigen::Index v = 0; v < V; ++v) p.col(v) = harmonics_of(heart, static_cast<std::uint32_t>(v)).col(0);
  // A place that is seen is asked for by where it is: the features have told what is there, whichever of the model's
  // vertices its registration puts there.
  const PredictedMotion field = surface.motion_at(p);
  const PredictedMotion unseen = surface.unseen_motion(V, own);
  for (Eigen::Index v = 0; v < V; ++v) {
    const double mm = std::sqrt((surface.mean_places().colwise() - p.col(v)).colwise().squaredNorm().minCoeff());
    const Zone zone = mm <= surface.support().reach_mm() ? kNear : mm <= kBeside_mm ? kBeside : kFar;
    const PredictedMotion& from = zone == kNear || by_field ? field : unseen;
    results.zones[zone].add(
        from.coefficients_W_mm.middleRows<3>(3 * v) - harmonics_of(heart, static_cast<std::uint32_t>(v)),
        from_six(from.covariances_W_mm2.col(v)));
  }
  ++results.trials;
  const auto& low = surface.motion()[static_cast<std::size_t>(HarmonicGroup::kLow)];
  if (low && !low->gains().empty()) {
    const HarmonicGain& gain = low->gains().front();
    results.gain += std::hypot(gain.in_step, gain.out_of_step);
    results.turn_rad += std::atan2(gain.out_of_step, gain.in_step);
    results.gain_deviation += std::sqrt(gain.variance);
    ++results.adopted;
  }
}

int main_with(int argc, char** argv) {
  CLI::App app("What a preoperative model that moves gives to the surface, over drawn trials");
  std::uint64_t seed = 1;
  int trials = 8;
  bool by_field = false;
  app.add_option("--seed", seed, "Another seed, other trials")->capture_default_str();
  app.add_option("--trials", trials, "of each case")->capture_default_str();
  app.add_flag("--field", by_field, "the field of motion everywhere, however far features are");
  CLI11_PARSE(app, argc, argv);
  const auto heart = parse_heart_mesh(embedded_epicardium_fourier_csv(), embedded_epicardium_faces_csv());
  if (!heart) throw std::runtime_error(heart.error().message);
  const std::vector<Model> models = {
      {"none", false},
      {"right", true, {}, true},
      {"right but for 20 %", true, [](PreoperativeSettings& s) { s.motion_error = 0.2; }, true},
      {"0.2 of a cycle early", true, [](PreoperativeSettings& s) { s.motion_shift_rad = 0.2 * kTurn_rad; }},
      {"half as large", true, [](PreoperativeSettings& s) { s.motion_scale = 0.5; }},
      {"another heart's", true, [](PreoperativeSettings& s) { s.other_motion = true; }}};
  GoalReport report;
  for (const double feature_mm : {0.1, 0.4}) {
    for (const std::size_t features : {8, 12, 20, 50, 100}) {
      SeenSettings seen;
      seen.features = features;
      seen.feature_mm = feature_mm;
      seen.common_mm = feature_mm > 0.2 ? 0.5 : 0.0;
      fmt::print("\n{} features, {} mm each\n", features, feature_mm);
      std::optional<Results> none;
      for (const Model& model : models) {
        Results results;
        const CounterNoise noise(seed, 4712);
        for (int i = 0; i < trials; ++i) {
          const std::uint64_t drawn = noise.bits(static_cast<std::uint64_t>(i));
          const Trial trial = trial_of(*heart, seen, drawn);
          const auto surface =
              PeriodicSurface::fit({static_cast<int>(heart->harmonics), 0}, trial.evidence, trial.patch.camera_W, {},
                                   {}, KernelSearch::kAnew, model.is_there ? motion_of(*heart, model, drawn) : nullptr);
          if (!surface) throw std::runtime_error(surface.error().message);
          judge(*heart, *surface, by_field, results);
        }
        if (!none) none = results;
        fmt::print("  {:22}", model.name);
        for (std::size_t zone = 0; zone < results.zones.size(); ++zone) {
          const Figures& of = results.zones[zone];
          fmt::print(" | {} {:.3f} ({:.3f}) {:5.2f} x{:.2f}", kZoneNames[zone], of.rms_mm(),
                     std::sqrt(of.claimed_mm2 / of.count), of.nees / of.count,
                     of.rms_mm() / none->zones[zone].rms_mm());
        }
        if (results.adopted > 0) {
          fmt::print(" | {} of {}: gain {:.2f} +- {:.2f} turned {:.0f} deg", results.adopted, results.trials,
                     results.gain / results.adopted, results.gain_deviation / results.adopted,
                     results.turn_rad / results.adopted * 180.0 / std::numbers::pi);
        }
        fmt::print("\n");
        if (!model.is_there) continue;
        for (std::size_t zone = 0; zone < results.zones.size(); ++zone) {
          report.at_most(fmt::format("  {}, {}: beside none", model.name, kZoneNames[zone]), 1.05,
                         results.zones[zone].rms_mm() / none->zones[zone].rms_mm());
        }
      }
    }
  }
  return report.failed() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace perimap::test

int main(int argc, char** argv) {
  try {
    return perimap::test::main_with(argc, argv);
  } catch (const std::exception& error) {
    (void)std::fprintf(stderr, "statistics_model_motion: %s\n", error.what());
    return 1;
  }
}
