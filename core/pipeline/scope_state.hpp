// The set-up of one frame, as the scope is turned and zoomed then.
#pragma once

#include <cstdint>
#include <optional>

#include "core/calibration/turn_reading.hpp"
#include "core/calibration/turned_scope.hpp"
#include "core/geometry/camera_model.hpp"
#include "core/geometry/pixel_map.hpp"

namespace perimap {

// The camera in the sensor's frame, and where the picture has what the calibrated lens has elsewhere.
struct ScopeState {
  Pose X_SC;
  PixelMap picture;
  double rotation_rad = 0.0;
  double rotation_deviation_rad = 0.0;
};

// States by a calibrated scope; and how often it was turned or zoomed meanwhile.
class ScopeStates {
 public:
  // `lens`: as calibrated.
  ScopeStates(const TurnedScope& scope, const CameraModel& lens) : scope_(scope), lens_(lens) {}

  // `radius_px`: the field stop's in the picture. None at a zoom that nobody calibrated.
  [[nodiscard]] std::optional<ScopeState> at(const TurnReading& turn, double radius_px) noexcept;

  [[nodiscard]] const TurnedScope& scope() const noexcept { return scope_; }
  // How often it was known to be turned or zoomed otherwise than before.
  [[nodiscard]] std::uint64_t turns() const noexcept { return turns_; }

 private:
  struct Known {
    double rotation_rad = 0.0;
    double radius_px = 0.0;
  };

  TurnedScope scope_;
  CameraModel lens_;
  std::optional<Known> known_;  // last
  std::uint64_t turns_ = 0;
};

}  // namespace perimap
