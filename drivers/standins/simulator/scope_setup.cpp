#include "drivers/standins/simulator/scope_setup.hpp"

#include <algorithm>

#include "core/angle/angle.hpp"
#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {

Vector3d heart_place_W() noexcept { return {140.0, -75.0, -230.0}; }

ScopeSetup usual_setup(int width_px, int height_px) noexcept {
  ScopeSetup setup;
  setup.lens = scope_lens(width_px, height_px);
  // The sensor sits beside the lens, some way up the shaft, turned about the shaft's axis.
  setup.X_SC = {so3_exp(Vector3d(0.15, -0.1, 1.2)), Vector3d(4.2, -6.8, 14.5)};
  return setup;
}

ScopeSetup drawn_setup(std::uint64_t seed, int width_px, int height_px) noexcept {
  constexpr std::uint64_t kStream = 0x7365747570;
  const CounterNoise noise(seed, kStream);
  std::uint64_t index = 0;
  const auto uniform = [&](double low, double high) { return noise.uniform(index++, low, high); };
  const auto vector = [&](double half) {
    return Vector3d(uniform(-half, half), uniform(-half, half), uniform(-half, half));
  };
  ScopeSetup setup;
  setup.lens = scope_lens(width_px, height_px);
  ScopeLens& lens = setup.lens;
  lens.fx *= uniform(0.85, 1.05);
  lens.fy = lens.fx * uniform(0.994, 1.006);
  lens.cx = 0.5 * (width_px - 1) + uniform(-0.03, 0.03) * width_px;
  lens.cy = 0.5 * (height_px - 1) + uniform(-0.03, 0.03) * height_px;
  lens.k1 = uniform(-0.25, -0.05);
  lens.k2 = uniform(0.0, 0.08);
  lens.p1 = uniform(-8e-4, 8e-4);
  lens.p2 = uniform(-8e-4, 8e-4);
  setup.X_SC.R = so3_exp(vector(0.4)) * so3_exp(Vector3d(0.0, 0.0, uniform(-3.1, 3.1)));
  setup.X_SC.t = vector(15.0) + Vector3d(0.0, 0.0, uniform(20.0, 80.0));
  setup.tracker_offset = from_seconds(uniform(0.005, 0.040));
  setup.tip_T = vector(8.0) + Vector3d(0.0, 0.0, uniform(100.0, 200.0));
  // The patient's image is about the heart, and so are its landmarks.
  const Matrix3d R_IW = so3_exp(vector(1.5));
  setup.X_IW = {R_IW, vector(40.0) - R_IW * heart_place_W()};
  setup.X_HS2 = {so3_exp(vector(1.2)), vector(20.0) - Vector3d(0.0, 0.0, uniform(30.0, 90.0))};
  return setup;
}

// Part by part: the shaft H in the sensor, and on it the objective O, which turns with the scope. What O sees is turned
// in the picture as the scope is in the head, and so is its notch: a direction p_O comes out along R_z(turn) p_O.
ScopeSetup turned_setup(const ScopeSetup& setup, const ScopeHeld& held, const Vector2d& centre_px) noexcept {
  const Pose X_HO{so3_exp(Vector3d(30.0 * kDegree, 0.0, 0.0)), Vector3d(0.6, -0.4, 0.0)};
  const Pose X_SH = setup.X_SC * X_HO.inverse();
  const Pose turned{so3_exp(Vector3d(0.0, 0.0, held.notch_rad)), Vector3d::Zero()};
  const Pose X_OC = turned.inverse();
  ScopeSetup result = setup;
  result.X_SC = X_SH * turned * X_HO * X_OC;
  result.X_SS2 = X_SH * turned * setup.X_HS2;
  const Vector2d arm = held.zoom * (Vector2d(setup.lens.cx, setup.lens.cy) - centre_px);
  const Vector2d place = centre_px + Vector3d(turned.R * Vector3d(arm.x(), arm.y(), 0.0)).head<2>();
  result.lens.fx *= held.zoom;
  result.lens.fy *= held.zoom;
  result.lens.cx = place.x();
  result.lens.cy = place.y();
  return result;
}

}  // namespace perimap
