// An error that lasts from one of a sensor's readings to the next.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/geometry/pose.hpp"
#include "core/time/instant.hpp"
#include "drivers/standins/random/counter_noise.hpp"

namespace perimap {

[[nodiscard]] inline Vector3d normal3(const CounterNoise& noise, std::uint64_t index) noexcept {
  return {noise.normal(3 * index), noise.normal(3 * index + 1), noise.normal(3 * index + 2)};
}

// A first-order Gauss-Markov process on three axes, of unit deviation from the first reading on. `correlation`: the
// time in which it falls to 1/e of what it was; 0: each reading's error is its own.
class SlowError {
 public:
  SlowError(double rate_hz, Duration correlation) noexcept
      : correlation_(correlation > Duration(0) ? std::exp(-1.0 / (rate_hz * to_seconds(correlation))) : 0.0) {}

  // Of the next reading, driven by a draw of unit deviation.
  Vector3d next(const Vector3d& drawn) noexcept {
    error_ = kept_ * error_ + std::sqrt(1.0 - kept_ * kept_) * drawn;
    kept_ = correlation_;
    return error_;
  }

 private:
  double correlation_;
  double kept_ = 0.0;  // the first reading's error is all its own
  Vector3d error_ = Vector3d::Zero();
};

}  // namespace perimap
