// What goes into and comes out of the eight lanes of a group: one feature a lane, arrays [component][lane].
#pragma once

#include <cstdint>

#include "core/estimation/iterated_update.hpp"

namespace perimap {

inline constexpr int kLanes = 8;

// Bit l stands for lane l.
using LaneMask = std::uint8_t;

// One held frame's measurements. Lanes outside `measured` are left alone; what stands in their places is not used.
template <class Real>
struct LaneObservations {
  LaneMask measured = 0;
  Real z[2][kLanes]{};  // px, or rad for bearings
  Real R[3][kLanes]{};  // covariance of z, pose noise included: R_00, R_10, R_11

  void set(int lane, const Vector2d& z_lane, const Matrix2d& R_lane) noexcept {
    measured = static_cast<LaneMask>(measured | 1U << lane);
    z[0][lane] = static_cast<Real>(z_lane.x());
    z[1][lane] = static_cast<Real>(z_lane.y());
    R[0][lane] = static_cast<Real>(R_lane(0, 0));
    R[1][lane] = static_cast<Real>(R_lane(1, 0));
    R[2][lane] = static_cast<Real>(R_lane(1, 1));
  }
};

// As UpdateOutcome. Says something only of the lanes in `considered`.
template <class Real>
struct LaneOutcomes {
  LaneMask considered = 0;  // had a measurement, and an estimate since before the sweep
  LaneMask accepted = 0;
  UpdateStatus status[kLanes]{};
  int iterations[kLanes]{};
  Real map_cost[kLanes]{};
  Real innovation[2][kLanes]{};
  Real normalised_innovation_squared[kLanes]{};
};

// Features at one instant, in frame W. Says something only of the lanes in `valid`.
template <class Real>
struct LaneMotions {
  LaneMask valid = 0;
  Real position[3][kLanes]{};    // mm
  Real velocity[3][kLanes]{};    // mm/s
  Real covariance[6][kLanes]{};  // mm^2: xx, yx, yy, zx, zy, zz

  [[nodiscard]] Vector3d position_of(int lane) const noexcept {
    return {double(position[0][lane]), double(position[1][lane]), double(position[2][lane])};
  }
  [[nodiscard]] Vector3d velocity_of(int lane) const noexcept {
    return {double(velocity[0][lane]), double(velocity[1][lane]), double(velocity[2][lane])};
  }
  [[nodiscard]] Matrix3d covariance_of(int lane) const noexcept {
    Matrix3d S;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j <= i; ++j) S(i, j) = S(j, i) = double(covariance[i * (i + 1) / 2 + j][lane]);
    }
    return S;
  }
};

}  // namespace perimap
