// The patient's reference tool: one that is tracked beside the scope's sensor, is fixed to the organ or to what holds
// it, and is moved as the organ is moved. It tells a moved organ from a tracker that errs about the scope.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "core/estimation/common_displacement.hpp"
#include "core/geometry/pose.hpp"
#include "core/pipeline/pose_history.hpp"
#include "core/sensors/tracker_sample.hpp"
#include "core/time/instant.hpp"

namespace perimap {

// By how much it has moved from its home, d = [omega, v] about a point, as that of a surface (common_displacement.hpp).
struct ToolMovement {
  bool told = false;  // false: it was not seen for most of the time, or has no home; the rest means nothing
  Vector6d d = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
};

// Its home is where it was while the organ was known to be where the map has it, some ten seconds ago, or while the
// map was learnt: so long a displacement may have gone on before it is told. Readings are kept as means of a tenth of a
// second. What is repeated bit for bit is no reading, but of a tracker that is said to be exact. Nothing is allocated;
// all members are called by the mapper thread.
class PatientTool {
 public:
  // The noise of the tracker: it errs about each tool by as much.
  explicit PatientTool(const PoseHistorySettings& tracker) noexcept : tracker_(tracker) {}

  void add(const TrackerSample& sample) noexcept;

  // Once a frame: whether the organ is where the map has it, as far as anybody knows.
  void heed_organ(bool at_its_place, Instant now) noexcept;
  // The map has been moved to where the organ was for the last two seconds: there its home is now.
  void move_home() noexcept;
  void forget() noexcept;

  // Over the last `window` until `now`, about the point.
  [[nodiscard]] ToolMovement moved(Duration window, Instant now, const Vector3d& about_W_mm) const noexcept;

 private:
  static constexpr Duration kBin = std::chrono::milliseconds(100);
  static constexpr std::uint64_t kBins = 256;

  struct Bin {
    std::int64_t number = -1;  // of kBin since the clock began; -1: empty
    double readings = 0.0;
    double position_variance_mm2 = 0.0;  // per axis of each; as the others here, the sum over the readings
    Vector3d t = Vector3d::Zero();
    Matrix3d R = Matrix3d::Zero();
  };
  struct Mean {
    Pose X_WO;
    double position_variance_mm2 = 0.0;   // per axis
    double rotation_variance_rad2 = 0.0;  // likewise
  };
  [[nodiscard]] std::optional<Mean> mean(Instant from, Instant until) const noexcept;

  PoseHistorySettings tracker_;
  std::array<Bin, kBins> bins_{};
  std::optional<Pose> last_;  // reading
  Instant newest_;
  std::optional<Instant> at_its_place_since_;
  Instant asked_;
  std::optional<Mean> home_;
};

}  // namespace perimap
