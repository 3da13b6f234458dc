// The tracker's recent readings, and the camera pose at any instant among them.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"

namespace perimap {

struct PoseHistorySettings {
  Pose X_SC;                            // hand-eye: camera in the tracked sensor's frame
  double position_deviation_mm = 0.0;   // of one reading, per axis
  double rotation_deviation_rad = 0.0;  // of one reading, per axis
  // Time in which the tracker's error falls to 1/e of what it was (Gauss-Markov); 0: it is new at each reading.
  Duration error_correlation{0};
  Duration time_offset{0};                               // added to the tracker's stamps to get the camera's time
  Duration maximum_gap = std::chrono::milliseconds(50);  // readings farther apart are not interpolated between
  Duration maximum_extrapolation = std::chrono::milliseconds(20);
};

// A reading is at least as far off as the device itself says (TrackerSample::error_mm): where that is more than
// position_deviation_mm stands for, both deviations grow in proportion; a tracker that is said to be exact has that
// error of its position.
//
// X_WC at one instant with its noise: the sensor's translation moves by an isotropic error of variance
// position_variance_mm2 per axis, and its rotation by one of rotation_variance_rad2 per axis about the sensor, which
// sits at -lever_W_mm from the camera centre.
struct CameraPose {
  enum class State : std::uint8_t {
    kMissing,  // no valid readings near enough: there is no pose, X_WC means nothing
    kInterpolated,
    kExtrapolated,  // past the newest reading by at most maximum_extrapolation; variances grown
  };
  State state = State::kMissing;
  Pose X_WC;
  Vector3d lever_W_mm = Vector3d::Zero();  // R_WS * t_SC
  double position_variance_mm2 = 0.0;
  double rotation_variance_rad2 = 0.0;
  // Of these, what is this pose's own and nothing of it in common with the poses before and after: that its readings
  // are farther off than usual, and what was not measured between and behind them.
  double own_position_variance_mm2 = 0.0;
  double own_rotation_variance_rad2 = 0.0;

  [[nodiscard]] bool valid() const noexcept { return state != State::kMissing; }
};

// Used by one thread. Readings must be added in order of their stamps; one that goes back in time is refused and
// counted. A reading that is not kOk is kept as what it is: a hole that is not interpolated across.
class PoseHistory {
 public:
  explicit PoseHistory(const PoseHistorySettings& settings) noexcept : settings_(settings) {}

  // From now on at() tells the pose by this hand-eye.
  void set_hand_eye(const Pose& X_SC) noexcept { settings_.X_SC = X_SC; }

  // False when the reading is refused: its stamp is not after the newest one's, or its pose is not finite.
  bool add(const TrackerSample& sample) noexcept;

  // The newest reading, valid or not, is at or after t: waiting longer can not improve at(t).
  [[nodiscard]] bool reached(Instant t) const noexcept;

  [[nodiscard]] CameraPose at(Instant t) const noexcept;

 private:
  static constexpr std::uint64_t kCapacity = 512;

  struct Reading {
    Instant time;  // on the camera's clock
    bool valid = false;
    Pose X_WS;
    double growth = 1.0;  // of both deviations
    double own_mm = 0.0;  // deviation per axis of a tracker that is said to be exact
  };

  [[nodiscard]] const Reading& reading(std::uint64_t index) const noexcept { return readings_[index % kCapacity]; }
  [[nodiscard]] Reading reading_of(const TrackerSample& sample) const noexcept;
  [[nodiscard]] CameraPose between(const Reading& r_0, const Reading& r_1, Instant t,
                                   CameraPose::State state) const noexcept;

  PoseHistorySettings settings_;
  std::array<Reading, kCapacity> readings_{};
  std::uint64_t count_ = 0;
};

}  // namespace perimap
