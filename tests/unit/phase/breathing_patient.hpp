// A patient who breathes, as a map shows it, for the tests of what finds and follows the breath.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/angle/angle.hpp"
#include "core/phase/respiratory_tracker.hpp"

namespace perimap::test {

using Eigen::Vector3d;

inline Instant at_s(double seconds) { return Instant(from_seconds(seconds)); }

// Breathing of 10 mm, at rest most of the time (sin^4), with a map's errors: white, a drift, and one in each heart
// beat.
struct Patient {
  double period_s = 4.0;
  double begin_s = 0.3;
  double amplitude_mm = 10.0;
  double noise_mm = 0.8;
  std::mt19937 generator{4};
  std::normal_distribution<double> normal{};

  [[nodiscard]] double breath(double t_s) const {
    const double sine = std::sin(std::numbers::pi * (t_s - begin_s) / period_s);
    return amplitude_mm * sine * sine * sine * sine;
  }
  [[nodiscard]] static double cardiac_rad(double t_s) { return std::fmod(kTwoPi * t_s / 0.83, kTwoPi); }

  Vector3d displacement(double t_s) {
    const Vector3d noise(normal(generator), normal(generator), normal(generator));
    return breath(t_s) * Vector3d(0.1, -0.35, -0.93) + noise_mm * noise + Vector3d(0.5, 0.02 * t_s, 0.0) +
           2.0 * std::cos(cardiac_rad(t_s)) * Vector3d(1.0, 0.0, 0.0);
  }
};

template <class Searching>
void watch(Searching& searching, Patient& patient, double from_s, double to_s) {
  for (double t = from_s; t < to_s; t += 1.0 / 30.0) {
    if constexpr (requires { searching.add(at_s(t), Vector3d(), 0.0); }) {
      searching.add(at_s(t), patient.displacement(t), Patient::cardiac_rad(t));
    } else {
      searching.add_displacement(at_s(t), patient.displacement(t), Patient::cardiac_rad(t));
    }
  }
}

struct Tracking : ::testing::Test {
  RespirationSettings settings;
  Patient patient;
  double now_s = 0.0;

  Tracking() { settings.enabled = true; }

  // Until locked; false when it does not within a minute.
  bool lock(RespiratoryTracker& tracker) {
    const double begun_s = now_s;
    while (tracker.clock().state != RespirationState::kLocked && now_s < begun_s + 60.0) {
      watch(tracker, patient, now_s, now_s + 1.0);
      now_s += 1.0;
      tracker.search(at_s(now_s));
    }
    return tracker.clock().state == RespirationState::kLocked;
  }
  // What the clock's phase says of the displacement, without the mean.
  static Vector3d predicted(const RespiratoryTracker& tracker, double t_s) {
    return tracker.wave().at(tracker.clock().at(at_s(t_s)).phase_rad);
  }
  [[nodiscard]] Vector3d truth(double t_s) const {
    return (patient.breath(t_s) - 0.375 * patient.amplitude_mm) * Vector3d(0.1, -0.35, -0.93);
  }
};

}  // namespace perimap::test
