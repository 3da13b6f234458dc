// How the pipeline is set up; plain values, filled by the daemon from its configuration.
#pragma once

#include <chrono>
#include <memory>
#include <optional>

#include "core/calibration/turned_scope.hpp"
#include "core/estimation/batch_start.hpp"
#include "core/estimation/iterated_update.hpp"
#include "core/estimation/precision.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/periodic/basis.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/r_trigger.hpp"
#include "core/phase/respiratory_tracker.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/pipeline/release_stream.hpp"
#include "core/pipeline/surface_sample.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct OrganModel;

struct FeatureSettings {
  int maximum = 200;  // some for what comes into view later
  Duration detection_interval = std::chrono::milliseconds(333);
  double minimum_distance_px = 18.0;
};

struct EstimatorSettings {
  BasisLayout layout;
  Precision precision = Precision::kDouble;  // of the mapped features; batch starts are always double
  Prior prior;
  UpdateSettings update;
  BatchSettings batch;
  int start_observations = 60;          // K, at most kMaxStartObservations
  double pixel_deviation_px = 0.3;      // floor of a match's standard deviation, per axis
  double converged_deviation_mm = 1.0;  // bound on the largest deviation over the cycle
};

struct PipelineSettings {
  CameraModel camera;
  PoseHistorySettings pose;
  // Of an angled scope, whose turn and zoom are read from its field stop in the pictures, or whose turn a second sensor
  // tells: the hand-eye, the focal length and the principal point then go by it, in place of pose.X_SC and the
  // camera's.
  std::optional<TurnedScope> turned_scope;
  bool watch_scope = false;        // without that: look in the pictures whether the scope is turned or zoomed meanwhile
  bool pictures_may_loop = false;  // the camera is a video that is played in a loop
  bool ecg_may_loop = false;       // likewise the ECG a record
  CardiacClockSettings clock;
  std::optional<RTriggerSettings> r_trigger;  // R peaks come from a trigger, not from the ECG's samples
  RespirationSettings respiration;
  FeatureSettings features;
  EstimatorSettings estimator;
  int workers = 2;
  Duration latency = std::chrono::milliseconds(50);  // L: release minus capture
  Duration lead{0};                                  // valid time minus release
  bool frame_stream = true;                          // a surface for each frame, at capture + L
  Duration clock_period{0};                          // a surface at each multiple of it, too; 0: none
  Duration budget = std::chrono::milliseconds(12);   // kept free for A to C before the release
  bool shedding = true;  // of features that the budget does not suffice for; not in lockstep
  Duration validity = std::chrono::milliseconds(200);
  UseBounds use_within_mm{5.0, 3.0, 2.0};
  std::shared_ptr<const OrganModel> organ_model;  // the topology of the surface; null: its own
  bool phase_from_image = true;
  bool law_from_image = false;                      // clock.law holds until the images show another
  Duration image_alone = std::chrono::seconds(10);  // the images carry the phase on so long without the ECG
  // D, for batch starts: counted in frames when the start is requested.
  Duration adoption_delay = std::chrono::milliseconds(500);
  // Lockstep: nothing is shed and every housekeeping result is there at its stated frame, so that a replay gives the
  // same samples every time.
  bool lockstep = false;
};

[[nodiscard]] inline bool publishes(const PipelineSettings& settings, ReleaseStream stream) noexcept {
  return stream == ReleaseStream::kFrame ? settings.frame_stream : settings.clock_period > Duration(0);
}
// That which stands for all where there is but one message.
[[nodiscard]] inline ReleaseStream first_stream(const PipelineSettings& settings) noexcept {
  return settings.frame_stream ? ReleaseStream::kFrame : ReleaseStream::kClock;
}

inline constexpr int kMaxStartObservations = 96;
// From a search for new features to their adoption the finder follows them through so many frames, about a thirtieth of
// a second apart where the camera is faster than that.
inline constexpr int kFinderFrames = 5;

}  // namespace perimap
