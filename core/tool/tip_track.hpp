// Where the tip of a tracked tool is, and how it moves: its readings as they come, and a prediction for any instant
// after them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <chrono>
#include <cstddef>
#include <optional>

#include "core/geometry/pose.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// The tip of a tool O.
struct TipInTool {
  Vector3d p_OT_mm = Vector3d::Zero();
  Matrix3d covariance_O_mm2 = Matrix3d::Zero();  // of its calibration
};

// At one instant.
struct TipPrediction {
  Vector3d p_WT_mm = Vector3d::Zero();
  Vector3d velocity_W_mm_per_s = Vector3d::Zero();
  // Of the position: the tracker's noise, what the tip may have done since the last reading, and its calibration.
  Matrix3d covariance_W_mm2 = Matrix3d::Zero();
};

// Filters of a point with a velocity that wanders (white acceleration; Bar-Shalom, Li & Kirubarajan 2001, 6.2.2), one
// for a tool at rest, one for a careful hand and one for a quick one, weighted by how each has foretold the readings of
// the last half second (multiple models, ibid. 11.6.2). A reading errs as the settings of the scope's own say: the
// tracker errs about each tool by as much. What it errs by for longer than from reading to reading is not averaged
// away.
//
// What is repeated bit for bit is no reading, but of a tracker that is said to be exact. A reading before the last, or
// one that is not finite, is passed over. Nothing is allocated. Used by one thread.
class TipTrack {
 public:
  // After so long without a reading the tip may be anywhere: it is begun anew.
  static constexpr Duration kLongestGap = std::chrono::milliseconds(250);

  TipTrack(const PoseHistorySettings& tracker, const TipInTool& tip) noexcept : tracker_(tracker), tip_(tip) {}

  void add(const TrackerSample& sample) noexcept;

  // Stamp of the last reading with a pose, on the camera's clock; none before the first.
  [[nodiscard]] std::optional<Instant> last_seen() const noexcept { return last_seen_; }
  // The tracker's last word is that it does not see the tool.
  [[nodiscard]] bool lost_sight() const noexcept { return lost_sight_; }

  // None before the first reading. For an instant before the last reading it tells that of the last reading.
  [[nodiscard]] std::optional<TipPrediction> at(Instant t) const noexcept;

 private:
  using State = Vector6d;  // position, velocity
  using Covariance = Eigen::Matrix<double, 6, 6>;
  struct Filter {
    State x = State::Zero();
    Covariance P = Covariance::Zero();
    double log_weight = 0.0;
  };
  static constexpr std::size_t kFilters = 3;

  static void advance(Filter& filter, double acceleration_mm2_per_s3, double dt) noexcept;
  void begin(const Vector3d& tip_W_mm, const Matrix3d& noise_mm2) noexcept;
  void update(const Vector3d& tip_W_mm, const Matrix3d& noise_mm2, double dt) noexcept;
  [[nodiscard]] Matrix3d noise_of(const TrackerSample& sample, const Vector3d& lever_W_mm) const noexcept;

  PoseHistorySettings tracker_;
  TipInTool tip_;
  std::array<Filter, kFilters> filters_{};
  Pose last_X_WO_;
  Matrix3d last_noise_mm2_ = Matrix3d::Zero();
  std::optional<Instant> last_seen_;
  std::optional<Instant> last_stamp_;  // of any reading
  bool lost_sight_ = false;
};

}  // namespace perimap
