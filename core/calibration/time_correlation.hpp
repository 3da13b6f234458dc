// The offset between two clocks by what both of them saw move: two signals are shifted until they fit.
//
// An offset is added to the second signal's times to get the first one's.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/calibration/timed_poses.hpp"

namespace perimap {

struct TimedValue {
  double t_s = 0.0;
  double value = 0.0;
};

// Evenly sampled; not a number where nothing was measured.
struct EvenSignal {
  double begin_s = 0.0;
  double interval_s = 0.0;
  std::vector<double> values;
};

// How fast it turns, rad/s, at even times: over `span_s` around each, so that noise weighs little. What a rigid body's
// sensors all see alike, wherever they are mounted.
[[nodiscard]] EvenSignal angular_speed(const std::vector<TimedPose>& poses, double interval_s, double span_s,
                                       double longest_gap_s);
// Linear between the samples, which are in the order of their times.
[[nodiscard]] EvenSignal at_even_times(const std::vector<TimedValue>& samples, double interval_s, double longest_gap_s);

struct Correlation {
  double offset_s = 0.0;
  double correlation = 0.0;  // -1 to 1
  double overlap_s = 0.0;    // in which both were measured
  double rival = 0.0;        // the highest |correlation| of another peak; 0: there is none
  double rival_offset_s = 0.0;
};

// The offset of at most `largest_offset_s` with the highest correlation (either_sign: with the highest magnitude), over
// at least `shortest_overlap_s`. None when they never overlap so long or one of them is constant.
[[nodiscard]] std::optional<Correlation> correlate(const EvenSignal& first, const EvenSignal& second,
                                                   double largest_offset_s, double shortest_overlap_s,
                                                   bool either_sign);

struct FittedOffset {
  double offset_s = 0.0;
  double deviation_s = 0.0;
  double gain = 0.0;  // first = gain * second + constant
  double residual_rms = 0.0;
  std::size_t used = 0;
  std::size_t discarded = 0;
};

// Least squares for offset, gain and constant, from an offset that is right within half a swing; samples off by more
// than four robust deviations are left out. None when fewer than ten samples overlap.
[[nodiscard]] std::optional<FittedOffset> fit_offset(const std::vector<TimedValue>& first,
                                                     const std::vector<TimedValue>& second, double offset_s,
                                                     double longest_gap_s);

}  // namespace perimap
