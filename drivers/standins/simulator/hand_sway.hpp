// A hand's sway about one axis: a slow one and a brisk one, each of two sines.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/geometry/pose.hpp"
#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {

class HandSway {
 public:
  HandSway() = default;
  // Amplitudes in the unit of what sways. Phases and, by a tenth, frequencies are drawn.
  HandSway(const CounterNoise& noise, std::uint64_t index, double slow, double brisk) noexcept {
    const std::array<double, 4> usual_hz{0.09, 0.17, 0.8, 1.3};
    const std::array<double, 4> amplitude{0.7 * slow, 0.3 * slow, 0.6 * brisk, 0.4 * brisk};
    for (std::size_t k = 0; k < waves_.size(); ++k) {
      const std::uint64_t at = 16 * index + 2 * k;
      waves_[k] = {amplitude[k], usual_hz[k] * noise.uniform(at, 0.9, 1.1),
                   noise.uniform(at + 1, 0.0, 2.0 * std::numbers::pi)};
    }
  }

  [[nodiscard]] double at(double t_s) const noexcept {
    double sum = 0.0;
    for (const Wave& wave : waves_) {
      sum += wave.amplitude * std::sin(2.0 * std::numbers::pi * wave.frequency_hz * t_s + wave.phase_rad);
    }
    return sum;
  }

 private:
  struct Wave {
    double amplitude = 0.0, frequency_hz = 0.0, phase_rad = 0.0;
  };
  std::array<Wave, 4> waves_{};
};

// Of three axes.
class HandSway3 {
 public:
  HandSway3() = default;
  HandSway3(const CounterNoise& noise, std::uint64_t index, const Vector3d& slow, const Vector3d& brisk) noexcept {
    for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      axes_[axis] = HandSway(noise, 3 * index + axis, slow[i], brisk[i]);
    }
  }

  [[nodiscard]] Vector3d at(double t_s) const noexcept {
    return {axes_[0].at(t_s), axes_[1].at(t_s), axes_[2].at(t_s)};
  }

 private:
  std::array<HandSway, 3> axes_;
};

}  // namespace perimap
