#include "drivers/standins/simulator/scope_path.hpp"

#include <cmath>

#include "core/angle/angle.hpp"
#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {
namespace {

// Camera axes (x right, y down, z forward) that look along `forward` with `up` upwards.
Matrix3d looking(const Vector3d& forward, const Vector3d& up) noexcept {
  Matrix3d R;
  const Vector3d z = forward.normalized();
  const Vector3d x = z.cross(up).normalized();
  R << x, z.cross(x), z;
  return R;
}

}  // namespace

double ScopePath::Sway::at(double t_s) const noexcept {
  return amplitude_1 * std::sin(kTwoPi * frequency_1_hz * t_s + phase_1_rad) +
         amplitude_2 * std::sin(kTwoPi * frequency_2_hz * t_s + phase_2_rad);
}

ScopePath::ScopePath(std::uint64_t seed, const Vector3d& rest_W, const Vector3d& target_W, const Vector3d& up_W,
                     double sweep) noexcept
    : X_WR_{looking(target_W - rest_W, up_W), rest_W}, distance_mm_((target_W - rest_W).norm()) {
  constexpr std::uint64_t kStream = 0x70617468;
  const CounterNoise noise(seed, kStream);
  std::uint64_t index = 0;
  // Frequencies vary by a few per cent from seed to seed, phases freely.
  const auto sway = [&](double amplitude_1, double frequency_1, double amplitude_2, double frequency_2) {
    Sway s{amplitude_1, frequency_1, 0.0, amplitude_2, frequency_2, 0.0};
    s.frequency_1_hz *= noise.uniform(index++, 0.96, 1.04);
    s.frequency_2_hz *= noise.uniform(index++, 0.96, 1.04);
    s.phase_1_rad = noise.uniform(index++, 0.0, kTwoPi);
    s.phase_2_rad = noise.uniform(index++, 0.0, kTwoPi);
    return s;
  };
  position_mm_[0] = sway(22.0, 0.127, 11.0, 0.0713);
  position_mm_[1] = sway(19.0, 0.0971, 10.0, 0.1637);
  position_mm_[2] = sway(9.0, 0.0617, 4.0, 0.1109);
  target_mm_[0] = sway(sweep * 4.0, 0.0831, sweep * 2.0, 0.211);
  target_mm_[1] = sway(sweep * 4.0, 0.0719, sweep * 2.0, 0.187);
  roll_rad_ = sway(0.06, 0.0533, 0.03, 0.139);
  // Physiological tremor of the hand, 8-10 Hz.
  for (Sway& axis : tremor_mm_) axis = sway(0.10, 8.4, 0.06, 9.7);
  for (Sway& axis : tremor_rad_) axis = sway(0.0007, 8.7, 0.0004, 9.9);
}

Pose ScopePath::X_WC(Duration since_start) const noexcept {
  const double t = to_seconds(since_start);
  Vector3d p_R;
  Vector3d target_R(target_mm_[0].at(t), target_mm_[1].at(t), distance_mm_);
  Vector3d tremor_C;
  for (int axis = 0; axis < 3; ++axis) {
    p_R[axis] = position_mm_[axis].at(t) + tremor_mm_[axis].at(t);
    tremor_C[axis] = tremor_rad_[axis].at(t);
  }
  const Vector3d up_R(0.0, -1.0, 0.0);
  const Matrix3d roll = so3_exp(Vector3d(0.0, 0.0, roll_rad_.at(t)));
  const Pose X_RC{looking(target_R - p_R, up_R) * roll * so3_exp(tremor_C), p_R};
  return X_WR_ * X_RC;
}

}  // namespace perimap
