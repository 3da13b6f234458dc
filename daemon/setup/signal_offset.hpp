// The offset between two clocks by a signal that both devices recorded: `perimap calibrate time`.
#pragma once

#include <vector>

#include "core/calibration/time_correlation.hpp"
#include "core/error/expected.hpp"

namespace perimap {

struct SignalOffset {
  double offset_s = 0.0;  // added to the second signal's times to get the first one's
  double deviation_s = 0.0;
  double correlation = 0.0;  // at that offset, -1 to 1
  double rival = 0.0;        // of the next best offset that is a peak of its own
  double rival_offset_s = 0.0;
  double overlap_s = 0.0;
  double gain = 0.0;          // first = gain * second + constant
  double residual_rms = 0.0;  // in units of the first
  std::size_t used = 0;       // samples of the first
  std::size_t discarded = 0;
  double first_half_s = 0.0;  // the offset by each half of the time alone
  double second_half_s = 0.0;
};

// Signals in the order of their times; one may be the other's negative, and in another unit. Fails, and says what is
// missing, when they never overlap or do not go together, or when repeated motion leaves open which offset it is.
[[nodiscard]] Expected<SignalOffset> measure_signal_offset(const std::vector<TimedValue>& first,
                                                           const std::vector<TimedValue>& second,
                                                           double largest_offset_s);

}  // namespace perimap
