// The third experiment: causal prediction of real motion, beside what others predict.
//
// From each sample of a stretch the next positions are predicted by what came before it alone. `ours` is a mean of
// predictors that err differently, by their merit so far: the periodic map with an autoregression on its residual, the
// autoregression of all points, and, where R peaks are given, the map by them. perimapd itself has no residual beside
// its map: the experiment tells what one is worth.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/evaluation/traces/trace_prediction.hpp"
#include "drivers/standins/trace/motion_trace.hpp"

namespace perimap {

struct TraceExperimentSettings {
  int from = 300;  // samples that are predicted from, the first and the last
  int to = 489;
  std::vector<double> horizons_s = {0.04, 0.08, 0.12, 0.2, 0.4};
  double lateral_noise_mm = 0.1;  // of the trace itself, x and y, by its authors' cameras
  double depth_noise_mm = 0.25;   // and z
  VectorAutoregressionSettings of_a_point{.lags = 35, .ridge = 300.0};
  VectorAutoregressionSettings of_all{.lags = 20, .ridge = 300.0};
  int fitted_every = 40;  // samples: the autoregressions of the motion
  int warm_up = 100;      // samples before the first start, whose errors tell the covariance
  TracePredictionSettings prediction;
};

inline constexpr const char* kAllPoints = "all";

struct TraceRow {
  std::string name;   // hold, ar_point, ar_all, periodic, ours
  std::string point;  // or kAllPoints
  double horizon_ms = 0.0;
  double rmse_mm = 0.0;
  double rmse_lateral_mm = 0.0;
  double nees = 0.0;  // squared error to the covariance told, a coordinate; of ours alone, not a number otherwise
  int starts = 0;
};

struct TraceExperiment {
  PhaseRates rates;
  bool with_r_peaks = false;
  int from = 0;
  int to = 0;
  std::vector<TraceRow> rows;
};

// Refuses a stretch that has too little before it, or nothing after it. Calls `progress` with starts done.
[[nodiscard]] Expected<TraceExperiment> run_trace_experiment(const TraceExperimentSettings& settings,
                                                             const MotionTrace& trace,
                                                             const std::vector<double>& r_peaks_s,
                                                             const std::function<void(int)>& progress);

}  // namespace perimap
