// What a trace's next samples are predicted to be, from those before them.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "daemon/evaluation/traces/cycle_lengths.hpp"
#include "daemon/evaluation/traces/vector_autoregression.hpp"
#include "drivers/standins/trace/phase_smoother.hpp"
#include "drivers/standins/trace/two_phase_map.hpp"

namespace perimap {

struct TracePredictionSettings {
  TwoPhaseMapSettings map;
  PhaseSmootherSettings phases;
  VectorAutoregressionSettings residual;  // about the map
  int first_iterations = 25;              // of phases and map, and so many for each sample that is new
  int iterations = 2;
  double detector_delay_s = 0.1;  // after which an R peak is known
};

// Some of the next samples, one a row, in mm.
struct MapPredictions {
  Eigen::MatrixXd map;            // the periodic map alone
  Eigen::MatrixXd with_residual;  // and an autoregression of what it leaves
};

// The map of both phases, fitted anew to all samples so far, with the phases told from the motion alone.
class MotionPhasePrediction {
 public:
  MotionPhasePrediction(const TracePredictionSettings& settings, double period_s, const PhaseRates& rates,
                        const Eigen::VectorXd& noise)
      : settings_(settings), period_s_(period_s), rates_(rates), noise_(noise) {}

  // `samples`: all so far, no fewer than before. `ahead`: samples, growing.
  [[nodiscard]] MapPredictions predict(const Eigen::MatrixXd& samples, const std::vector<int>& ahead);

 private:
  TracePredictionSettings settings_;
  double period_s_;
  PhaseRates rates_;
  Eigen::VectorXd noise_;
  std::optional<PhaseTracks> tracks_;
};

// Likewise with the phase of the heart from R peaks, by the law (stretched as a whole, or after systole) that leaves
// the least of the samples before the first prediction, and averaged over the lengths that the last cycle may have, by
// how well the last samples agree with each.
class RPeakPrediction {
 public:
  // `peaks_s`: on a clock whose zero is the first sample. Only those of more than the detector's delay ago are used.
  RPeakPrediction(const TracePredictionSettings& settings, double period_s, const PhaseRates& rates,
                  const Eigen::VectorXd& noise, std::vector<double> peaks_s)
      : settings_(settings), period_s_(period_s), rates_(rates), noise_(noise), peaks_s_(std::move(peaks_s)) {}

  // Nothing while fewer than three peaks are known.
  [[nodiscard]] std::optional<MapPredictions> predict(const Eigen::MatrixXd& samples, const std::vector<int>& ahead);

 private:
  // Phases by the cycles, the last one so long; breathing is smoothed.
  [[nodiscard]] TwoPhaseMap fit(const Eigen::MatrixXd& samples, const CycleLengths& cycles, double last_length_s,
                                bool first, PhaseTracks& tracks) const;
  void choose_law(const Eigen::MatrixXd& samples, const std::vector<double>& known_s, double known_until_s);

  TracePredictionSettings settings_;
  double period_s_;
  PhaseRates rates_;
  Eigen::VectorXd noise_;
  std::vector<double> peaks_s_;
  double systole_s_ = 0.0;
  std::optional<PhaseTracks> tracks_;
};

}  // namespace perimap
