// Motion that is made: a heart whose rate wanders, breathing, noise.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "core/angle/angle.hpp"
#include "drivers/standins/trace/motion_trace.hpp"

namespace perimap::test {

struct MadeTrace {
  MotionTrace trace;
  std::vector<double> r_peaks_s;
};

// Two points at 25 Hz; cycles of `cycle_s` with the deviation `wander_s`, each its own.
inline MadeTrace made_trace(std::uint64_t seed, int samples, double cycle_s, double wander_s, double noise_mm) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  MadeTrace made;
  made.trace.points = {"A", "B"};
  made.trace.first_s = 3.0;
  made.trace.period_s = 0.04;
  made.trace.positions.resize(samples, 6);
  double peak_s = -0.3;
  double length_s = cycle_s;
  for (int i = 0; i < samples; ++i) {
    const double t = 0.04 * i;
    while (t >= peak_s + length_s) {
      peak_s += length_s;
      length_s = cycle_s + wander_s * normal(generator);
      made.r_peaks_s.push_back(made.trace.first_s + peak_s);
    }
    const double phi = kTwoPi * (t - peak_s) / length_s;
    const double psi = kTwoPi * t / 5.0;
    for (int k = 0; k < 6; ++k) {
      made.trace.positions(i, k) = 10.0 * k + 2.0 * std::cos(phi + k) + 0.7 * std::sin(2.0 * phi - k) +
                                   1.5 * std::cos(psi + 0.5 * k) +
                                   (k % 3 == 2 ? 2.5 : 1.0) * noise_mm * normal(generator);
    }
  }
  return made;
}

}  // namespace perimap::test
