// Some seconds of a session's matches, as the watch over the set-up judges them.
#pragma once

#include <vector>

#include "core/geometry/pose.hpp"
#include "core/periodic/basis.hpp"
#include "core/periodic/periodic_motion.hpp"
#include "core/setup_watch/setup_deviation.hpp"

namespace perimap {

struct WatchedMatch {
  int feature = 0;  // which of the window's features
  Vector2d px = Vector2d::Zero();
  Matrix2d covariance_px2 = Matrix2d::Identity();  // of the match alone; positive definite
};

struct WatchedFrame {
  double t_s = 0.0;                        // of the capture, from any origin
  Pose X_WC;                               // by the configured set-up
  CameraTwist twist;                       // likewise
  Vector3d lever_W_mm = Vector3d::Zero();  // R_WS t_SC, from the sensor to the camera
  // Of one pose: the sensor's position and its turn about itself, per axis. Positive.
  double position_variance_mm2 = 0.0;
  double rotation_variance_rad2 = 0.0;
  Basis b;                            // at the capture's phases
  Basis b_rate;                       // its change in a second of the cardiac phase
  double phase_deviation_s = 0.0;     // of the cardiac phase
  std::vector<WatchedMatch> matches;  // of different features
};

struct WatchedWindow {
  std::vector<WatchedFrame> frames;  // in the order of their times
  // What the map has of each feature: where the estimate begins.
  std::vector<StateVector> features;
  // In which the tracker's error falls to 1/e of what it was; 0: it is new in each frame.
  double error_correlation_s = 0.0;
};

}  // namespace perimap
