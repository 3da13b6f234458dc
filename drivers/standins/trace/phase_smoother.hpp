// Phases of heart and breathing from motion alone: their rates by search, their course by a Kalman smoother.
#pragma once

#include <Eigen/Core>

#include "drivers/standins/trace/two_phase_map.hpp"

namespace perimap {

struct PhaseSmootherSettings {
  double cardiac_noise = 0.3;        // rad^2/s^3, of the rate's random walk
  double respiratory_noise = 0.003;  // ventilators are even
  // The residuals are no white noise: neighbours tell nearly the same. By so much less is a sample's word.
  double caution = 4.0;
};

struct PhaseRates {
  double cardiac_hz = 0.0;
  double respiratory_hz = 0.0;
};

// The two rates whose harmonics (three and two) explain the most of the samples, each channel in units of its noise.
[[nodiscard]] PhaseRates find_rates(const Eigen::MatrixXd& samples, double period_s, const Eigen::VectorXd& noise);

// Tracks of constant rates, from phase zero; and the same tracks carried on at their last rates to `count` samples.
[[nodiscard]] PhaseTracks steady_tracks(const PhaseRates& rates, double period_s, Eigen::Index count);
void carry_on(PhaseTracks& tracks, double period_s, Eigen::Index count);

// One iteration: the map is linearised about the tracks, and both phases and rates are smoothed (Rauch, Tung &
// Striebel, AIAA J. 3(8), 1965). With `cardiac_known` only those of breathing are changed.
void smooth_phases(const PhaseSmootherSettings& settings, const TwoPhaseMap& map, const Eigen::MatrixXd& samples,
                   double period_s, bool cardiac_known, PhaseTracks& tracks);

}  // namespace perimap
