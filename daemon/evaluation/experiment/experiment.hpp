// The paper's two experiments (Tully, Kantor & Choset 2013, Sec. IV) on simulated trials: tables and figures.
//
//   1  surface motion of a real heart from MRI, a camera on a path around it, bearings with noise of 0.2 degrees, cycle
//      lengths of a real ECG; like Figs. 4 and 5
//   2  a laparoscope's view of a patch that moves 13 mm along the optical axis: 8 features, pixels, a tracker with 1.4
//      mm RMS, features followed for 60 to 480 frames; like Figs. 7 and 8
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/error/expected.hpp"
#include "daemon/evaluation/experiment/comparison.hpp"
#include "daemon/pages/svg_plot.hpp"

namespace perimap {

struct ExperimentFigure {
  std::string name;   // of its files, one of experiment_figures()
  std::string title;  // one line
  std::vector<Plot> plots;
};

struct Experiment {
  int number = 0;
  std::string title;
  std::string setting;  // what was simulated, one line
  std::uint64_t seed = 0;
  int trials = 0;
  std::vector<MethodRow> rows;
  std::vector<ExperimentFigure> figures;
};

struct ExperimentSettings {
  int number = 1;  // 1 or 2
  std::uint64_t seed = 1;
  int trials = 100;
  MethodOptions methods;
};

// The figures that experiment 1 or 2 has, in their order.
[[nodiscard]] std::vector<const char*> experiment_figures(int number);

// Calls `progress` with the number of trials done. Deterministic but for the times.
[[nodiscard]] Expected<Experiment> run_experiment(const ExperimentSettings& settings,
                                                  const std::function<void(int trials)>& progress);

}  // namespace perimap
