// How a simulated scope, its tracker and a pointer are put together: what a calibration has to find.
#pragma once

#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/simulator/field_stop.hpp"
#include "drivers/standins/simulator/lens.hpp"

namespace perimap {

struct ScopeSetup {
  ScopeLens lens;
  Pose X_SC;                                    // the camera in the tracked sensor
  Duration tracker_offset{0};                   // to be added to the tracker's stamps to get the camera's clock
  Vector3d tip_T = Vector3d(1.5, -2.0, 148.0);  // the pointer's tip in its sensor's frame, mm
  // The second tracked sensor, on the scope: in the frame of its shaft, and where it is in that of the sensor on the
  // head.
  Pose X_HS2 = {so3_exp(Vector3d(0.3, -0.5, 0.8)), Vector3d(14.0, -11.0, -60.0)};
  Pose X_SS2;
  Pose X_IW = {Matrix3d::Identity(), Vector3d::Zero()};  // the tracker's frame in the patient's image
};

// Where a simulated heart lies in the tracker's frame, mm.
[[nodiscard]] Vector3d heart_place_W() noexcept;

// The scope as it is where nothing is drawn.
[[nodiscard]] ScopeSetup usual_setup(int width_px, int height_px) noexcept;

// Drawn at random: another lens of about the same view, the sensor elsewhere on the scope, a tracker that stamps its
// poses 5 to 40 ms early, another pointer, another image. A function of its arguments alone.
[[nodiscard]] ScopeSetup drawn_setup(std::uint64_t seed, int width_px, int height_px) noexcept;

// The same scope, held so, of an objective that looks 30 degrees aside; `setup` is that at a notch of 0 and a zoom
// of 1. The sensor is on the head, the second one on the scope. `centre_px`: of the field stop, about which the picture
// turns and grows.
[[nodiscard]] ScopeSetup turned_setup(const ScopeSetup& setup, const ScopeHeld& held,
                                      const Vector2d& centre_px) noexcept;

}  // namespace perimap
