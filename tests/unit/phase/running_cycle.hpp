// A heart whose running cycle the images show, for the tests of what is made of that.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <random>

#include "core/angle/angle.hpp"
#include "core/phase/cardiac_clock_tracker.hpp"
#include "core/phase/cycle_posterior.hpp"

namespace perimap::test {

using std::chrono::milliseconds;

// Twenty beats 800 ms apart within some milliseconds, so that the next length is predicted with a few percent. The
// cycle after them truly begins at `begin` and lasts `length`; the heart runs evenly from R peak to R peak.
struct Cycle : ::testing::Test {
  CardiacClockTracker tracker{CardiacClockSettings{}};
  CyclePosterior posterior;
  std::mt19937 generator{7};
  Instant begin;
  Duration length = milliseconds(830);
  static constexpr double kDeviation_s = 2e-3;

  Cycle() { beat({}); }

  void beat(const CardiacClockSettings& settings) {
    tracker = CardiacClockTracker(settings);
    std::normal_distribution<double> scatter(0.0, 0.03);
    Instant t = from_ns(5'000'000'000);
    for (int i = 0; i < 20; ++i) {
      tracker.on_r_peak({t, t + milliseconds(90), 1.0, milliseconds(2)});
      begin = t;
      t += from_seconds(0.8 + scatter(generator));
    }
  }

  [[nodiscard]] double true_phase(Instant t) const { return kTwoPi * to_seconds(t - begin) / to_seconds(length); }

  void observe(Instant t, double wrong_by_s = 0.0) {
    std::normal_distribution<double> noise(0.0, kDeviation_s);
    const double rate = kTwoPi / to_seconds(length);
    posterior.follow(tracker.clock(), t);
    posterior.add({t, true_phase(t) + rate * (noise(generator) + wrong_by_s), rate * kDeviation_s});
  }
  void observe_until(Duration since_begin) {
    for (Duration s = milliseconds(20); s <= since_begin; s += milliseconds(33)) observe(begin + s);
  }
  [[nodiscard]] double length_error_s() const { return to_seconds(posterior.correction().length - length); }
};

}  // namespace perimap::test
