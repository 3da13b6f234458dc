#include "daemon/evaluation/experiment/experiment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/angle/angle.hpp"
#include "daemon/evaluation/experiment/accuracy_figures.hpp"

namespace perimap {
namespace {

constexpr double kFirstDepth_mm = 90.0;
// Earlier errors, tens of millimetres in depth, would flatten the curves.
constexpr double kErrorsFrom_s = 2.0;
// The figures, as their files are named.
constexpr const char* kCycle = "cycle";
constexpr const char* kPaths = "paths";
constexpr const char* kInnovation = "innovation";
constexpr const char* kError = "error";
constexpr const char* kTruthColor = "#9a9a9a";
constexpr const char* kBoundColor = "#222222";

const char* color_of(MethodKind kind) {
  switch (kind) {
    case MethodKind::kStaticEkf:
      return "#c0392b";
    case MethodKind::kFourierEkf:
      return "#e08e0b";
    case MethodKind::kIterated:
      return "#7d3c98";
    case MethodKind::kDelayed:
      return "#1f6f8b";
    case MethodKind::kBatch:
      return "#1e8449";
  }
  return kTruthColor;
}

const std::vector<MethodKind> kEveryMethod = {MethodKind::kStaticEkf, MethodKind::kFourierEkf, MethodKind::kIterated,
                                              MethodKind::kDelayed, MethodKind::kBatch};

SceneSettings scene_settings(const ExperimentSettings& settings, int trial) {
  SceneSettings scene;
  scene.seed = settings.seed * 1000 + static_cast<std::uint64_t>(trial);
  if (settings.number == 1) {
    scene.surface = SceneSurface::kHeart;
    scene.bearings = true;
    scene.features = 5;
    scene.frames = 600;
    scene.deviation = 0.2 * kDegree;
    scene.ecg_record = "100";
  } else {
    scene.surface = SceneSurface::kPlate;
    scene.features = 8;
    scene.frames = 480;
    scene.min_frames = 60;
    scene.deviation = 0.7;
    scene.ecg_record = "100";
    scene.pose_error = {1.4, 0.5 * kDegree, 0.0};
  }
  return scene;
}

// Depth along the optical axis of the rest pose over the cycle, with two standard deviations on either side.
Plot cycle_plot(const Scene& scene, const SceneFeature& feature, MethodKind kind, const MethodSetting& setting,
                const MethodOptions& options, int sightings) {
  const auto method = make_method(kind, setting, options);
  for (int k = 0; k < sightings; ++k) method->observe(feature.sightings[static_cast<std::size_t>(k)]);
  Plot plot;
  plot.title = method_name(kind) + ", after " + std::to_string(sightings) + " sightings";
  plot.x_label = "phase (cycles)";
  plot.y_label = "position along the viewing axis (mm)";
  PlotLine truth{{}, kTruthColor, 3.0, "truth"};
  PlotLine mean{{}, color_of(kind), 1.8, "estimate"};
  PlotLine low{{}, color_of(kind), 0.7, "2 standard deviations"};
  PlotLine high{{}, color_of(kind), 0.7, ""};
  const FeatureEstimate* estimate = method->estimate();
  constexpr int kSteps = 100;
  for (int i = 0; i <= kSteps; ++i) {
    const double cycles = static_cast<double>(i) / kSteps;
    const double phase_rad = 2.0 * std::numbers::pi * cycles;
    truth.points.push_back({cycles, scene.axis_W.dot(scene.true_position(feature, phase_rad))});
    if (estimate == nullptr) continue;
    const Basis b = basis_at(method->layout(), phase_rad);
    const double y = scene.axis_W.dot(estimate->position(b));
    const double deviation = std::sqrt(scene.axis_W.dot(estimate->position_covariance(b) * scene.axis_W));
    mean.points.push_back({cycles, y});
    low.points.push_back({cycles, y - 2.0 * deviation});
    high.points.push_back({cycles, y + 2.0 * deviation});
  }
  plot.lines = {truth, low, high, mean};
  return plot;
}

ExperimentFigure cycle_figure(const Scene& scene, const MethodSetting& setting, const MethodOptions& options) {
  const SceneFeature& feature = scene.features.front();
  const int all = static_cast<int>(feature.sightings.size());
  return {kCycle,
          "One feature's cycle at the start and after convergence",
          {cycle_plot(scene, feature, MethodKind::kIterated, setting, options, 10),
           cycle_plot(scene, feature, MethodKind::kDelayed, setting, options, options.buffered),
           cycle_plot(scene, feature, MethodKind::kDelayed, setting, options, all)}};
}

Plot error_plot(const Comparison& comparison, const std::vector<MethodKind>& kinds, const std::string& title) {
  Plot plot;
  plot.title = title;
  plot.x_label = "time (s)";
  plot.y_label = "path error (mm)";
  plot.y_from_zero = true;
  const auto line = [&](const std::string& name, const char* color) {
    PlotLine curve{{}, color, 2.0, name};
    for (const auto& point : comparison.curve(name)) {
      if (point.time_s >= kErrorsFrom_s) curve.points.push_back({point.time_s, point.median_mm});
    }
    plot.lines.push_back(curve);
  };
  for (const MethodKind kind : kinds) line(method_name(kind), color_of(kind));
  line(Comparison::kBound, kBoundColor);
  return plot;
}

ExperimentFigure error_figure(const Comparison& comparison) {
  return {kError,
          "Median error over time",
          {error_plot(comparison,
                      {MethodKind::kStaticEkf, MethodKind::kFourierEkf, MethodKind::kIterated, MethodKind::kDelayed},
                      "All methods"),
           error_plot(comparison, {MethodKind::kDelayed}, "Delayed start and the bound")}};
}

// Seen from above the viewing axis: along it (y) and across it (x).
ExperimentFigure paths_figure(const Scene& scene, const MethodSetting& setting, const MethodOptions& options) {
  Plot plot;
  plot.title = "Motion of the features over one cycle";
  plot.x_label = "x_W (mm)";
  plot.y_label = "z_W, along the viewing axis (mm)";
  plot.equal_aspect = true;
  struct Drawn {
    MethodKind kind;
    double width_px;
  };
  bool first = true;
  for (const SceneFeature& feature : scene.features) {
    if (static_cast<int>(feature.sightings.size()) < options.buffered) continue;
    PlotLine truth{{}, kTruthColor, 4.0, first ? "truth" : ""};
    constexpr int kSteps = 60;
    for (int i = 0; i <= kSteps; ++i) {
      const Vector3d p = scene.true_position(feature, 2.0 * std::numbers::pi * i / kSteps);
      truth.points.push_back({p.x(), p.z()});
    }
    plot.lines.push_back(truth);
    for (const Drawn drawn :
         {Drawn{MethodKind::kStaticEkf, 6.0}, Drawn{MethodKind::kIterated, 1.0}, Drawn{MethodKind::kDelayed, 1.6}}) {
      const auto method = make_method(drawn.kind, setting, options);
      for (const Sighting& sighting : feature.sightings) method->observe(sighting);
      PlotLine line{{}, color_of(drawn.kind), drawn.width_px, first ? method_name(drawn.kind) : ""};
      const FeatureEstimate* estimate = method->estimate();
      for (int i = 0; i <= kSteps && estimate != nullptr; ++i) {
        Vector3d p = estimate->position(basis_at(method->layout(), 2.0 * std::numbers::pi * i / kSteps));
        // A point of no length would not be drawn.
        if (drawn.kind == MethodKind::kStaticEkf && i > 0) p.x() += 0.6;
        line.points.push_back({p.x(), p.z()});
      }
      plot.lines.push_back(line);
    }
    first = false;
  }
  return {kPaths, "Bird's-eye view of the motion paths", {plot}};
}

// Least squares of y = a + b exp(-t / tau); tau from a grid.
PlotLine exponential_fit(const std::vector<PlotPoint>& points, const char* color) {
  double best = std::numeric_limits<double>::infinity();
  double a = 0.0;
  double b = 0.0;
  double tau = 1.0;
  constexpr int kTrials = 60;
  for (int k = 0; k < kTrials; ++k) {
    const double trial = 0.1 * std::pow(1.1, k);
    double n = 0.0;
    double se = 0.0;
    double see = 0.0;
    double sy = 0.0;
    double sey = 0.0;
    for (const PlotPoint& p : points) {
      const double e = std::exp(-p.x / trial);
      n += 1.0;
      se += e;
      see += e * e;
      sy += p.y;
      sey += e * p.y;
    }
    const double determinant = n * see - se * se;
    if (!(determinant > 1e-9 * n * see)) continue;
    const double b_trial = (n * sey - se * sy) / determinant;
    const double a_trial = (sy - b_trial * se) / n;
    double residual = 0.0;
    for (const PlotPoint& p : points) {
      const double r = p.y - a_trial - b_trial * std::exp(-p.x / trial);
      residual += r * r;
    }
    if (residual < best) {
      best = residual;
      a = a_trial;
      b = b_trial;
      tau = trial;
    }
  }
  PlotLine line{{}, color, 2.5, "fitted a + b exp(-t / tau)"};
  for (const PlotPoint& p : points) line.points.push_back({p.x, a + b * std::exp(-p.x / tau)});
  return line;
}

Plot innovation_plot(const Comparison& comparison, MethodKind kind) {
  Plot plot;
  plot.title = "Static EKF minus " + method_name(kind);
  plot.x_label = "time (s)";
  plot.y_label = "difference of innovations (px)";
  PlotLine line{{}, color_of(kind), 0.8, "mean over features"};
  for (const auto& point : comparison.innovation_difference(kind))
    line.points.push_back({point.time_s, point.difference});
  plot.lines = {line, exponential_fit(line.points, kBoundColor)};
  return plot;
}

ExperimentFigure innovation_figure(const Comparison& comparison) {
  return {kInnovation,
          "What the moving model predicts better: difference of the innovations, static less dynamic",
          {innovation_plot(comparison, MethodKind::kIterated), innovation_plot(comparison, MethodKind::kDelayed)}};
}

}  // namespace

std::vector<const char*> experiment_figures(int number) {
  return number == 1 ? std::vector{kCycle, kError} : std::vector{kPaths, kInnovation, kError};
}

Expected<Experiment> run_experiment(const ExperimentSettings& settings,
                                    const std::function<void(int trials)>& progress) {
  const auto heart = load_heart();
  if (!heart) return tl::unexpected(heart.error());
  constexpr double kInterval_s = 0.5;
  const BasisLayout layout;
  Comparison comparison(kEveryMethod, layout, Prior{}, kFirstDepth_mm, kInterval_s, settings.methods);
  Experiment experiment;
  experiment.number = settings.number;
  experiment.seed = settings.seed;
  experiment.trials = settings.trials;
  if (settings.number == 1) {
    experiment.title = "Experiment 1: surface of a real heart";
    experiment.setting =
        "heart from MRI, rhythm of MIT-BIH record 100, bearings with 0.2 degrees, 5 features a trial, 20 s at 30 Hz, "
        "phase and association known";
  } else {
    experiment.title = "Experiment 2: laparoscope";
    experiment.setting =
        "patch moving 13 mm along the optical axis, 8 features a trial followed for 60 to 480 frames, pixels with 0.7 "
        "px at f = 700 px, tracker 1.4 mm and 0.5 degrees RMS, phase and association known";
  }
  experiment.setting += fmt::format("; the paper's update with gamma {:g} and {} iterations",
                                    settings.methods.paper_step, settings.methods.paper_iterations);
  for (int trial = 0; trial < settings.trials; ++trial) {
    const auto scene = make_scene(scene_settings(settings, trial), *heart);
    if (!scene) return tl::unexpected(scene.error());
    comparison.add(*scene);
    if (trial == 0) {
      const MethodSetting setting{&*scene, layout, Prior{}, kFirstDepth_mm};
      if (settings.number == 1) experiment.figures.push_back(cycle_figure(*scene, setting, settings.methods));
      if (settings.number == 2) experiment.figures.push_back(paths_figure(*scene, setting, settings.methods));
    }
    progress(trial + 1);
  }
  experiment.rows = comparison.rows();
  experiment.figures.push_back(settings.number == 1 ? error_figure(comparison) : innovation_figure(comparison));
  if (settings.number == 2) experiment.figures.push_back(error_figure(comparison));
  return experiment;
}

}  // namespace perimap
