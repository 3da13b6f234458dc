// A tracker's noise and how long its error lasts, measured from a sensor that is held still.
#pragma once

#include <string>
#include <vector>

#include "core/calibration/timed_poses.hpp"
#include "core/error/expected.hpp"

namespace perimap {

struct AllanPoint {
  double averaged_s = 0.0;
  double position_mm = 0.0;   // Allan deviation of the 3-D position
  double rotation_deg = 0.0;  // of the 3-D orientation
};

struct MeasuredNoise {
  double position_deviation_mm = 0.0;   // RMS of the 3-D norm
  double rotation_deviation_deg = 0.0;  // RMS of the 3-D norm
  double correlation_s = 0.0;           // in which the error that lasts falls to 1/e; 0: each pose's is new
  double lasting_share = 0.0;           // of the variance that lasts so long; the rest is new in each pose
  // Standard deviations of these figures.
  double position_deviation_mm_deviation = 0.0;
  double rotation_deviation_deg_deviation = 0.0;
  double correlation_s_factor = 1.0;  // the correlation time is known within this factor (one standard deviation)
  std::vector<AllanPoint> allan;
  double still_s = 0.0;  // how long it was still
  std::size_t poses = 0;
  bool drifts = false;  // the error lasts longer than a tenth of the time it was watched
};

// From the longest stretch in which nothing moved by more than noise does (poses X_WS in the order of their times): the
// restricted likelihood of a first-order Gauss-Markov error of one correlation time and a white one beside it, over the
// six axes together (a Kalman filter's innovations; Harvey 1989), maximised over both. Fails when the sensor was not
// still for at least ten seconds and two hundred poses.
[[nodiscard]] Expected<MeasuredNoise> measure_tracker_noise(const std::vector<TimedPose>& all);

}  // namespace perimap
