#include "daemon/setup/signal_offset.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/statistics/upper_median.hpp"

namespace perimap {
namespace {

constexpr std::size_t kFewestSamples = 20;
constexpr double kLowestCorrelation = 0.5;
constexpr std::size_t kMostLags = 4000;

double median_interval_s(const std::vector<TimedValue>& signal) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < signal.size(); ++i) intervals.push_back(signal[i].t_s - signal[i - 1].t_s);
  return upper_median(intervals.begin(), intervals.end());
}

// By the samples of the signal that has fewer of them, over the one that has more.
std::optional<FittedOffset> fit(const std::vector<TimedValue>& first, const std::vector<TimedValue>& second,
                                double offset_s, double gap_first_s, double gap_second_s) {
  if (gap_second_s <= gap_first_s) return fit_offset(first, second, offset_s, gap_second_s);
  // NOLINTNEXTLINE(readability-suspicious-call-argument): turned round, by the one that has fewer samples
  auto turned = fit_offset(second, first, -offset_s, gap_first_s);
  if (turned) {
    turned->offset_s = -turned->offset_s;
    turned->residual_rms /= std::max(1e-300, std::abs(turned->gain));
    turned->gain = 1.0 / turned->gain;
  }
  return turned;
}

}  // namespace

Expected<SignalOffset> measure_signal_offset(const std::vector<TimedValue>& first,
                                             const std::vector<TimedValue>& second, double largest_offset_s) {
  if (first.size() < kFewestSamples || second.size() < kFewestSamples) {
    return fail(fmt::format("too few samples: {} and {}, and at least {} of each are needed", first.size(),
                            second.size(), kFewestSamples));
  }
  const double interval_1 = median_interval_s(first);
  const double interval_2 = median_interval_s(second);
  const double gap_1 = std::max(0.2, 3.0 * interval_1);
  const double gap_2 = std::max(0.2, 3.0 * interval_2);
  const double grid_s =
      std::max(0.5 * std::min(interval_1, interval_2), 2.0 * largest_offset_s / static_cast<double>(kMostLags));
  const double shortest_s = std::max(2.0, 20.0 * grid_s);
  const auto found = correlate(at_even_times(first, grid_s, gap_1), at_even_times(second, grid_s, gap_2),
                               largest_offset_s, shortest_s, true);
  if (!found) {
    return fail(fmt::format(
        "the signals never overlap by {:.1f} s within {:.1f} s of clock offset (the first {:.3f} to {:.3f} s, the "
        "second "
        "{:.3f} to {:.3f} s), or one of them is constant: give the same minutes, or allow more with --largest-offset-s",
        shortest_s, largest_offset_s, first.front().t_s, first.back().t_s, second.front().t_s, second.back().t_s));
  }
  if (std::abs(found->correlation) < kLowestCorrelation) {
    return fail(fmt::format("the signals do not go together (correlation {:.2f} at most): are they of the same motion?",
                            found->correlation));
  }
  const auto fitted = fit(first, second, found->offset_s, gap_1, gap_2);
  if (!fitted) return fail("the signals overlap in fewer than ten samples: record longer");
  // Peaks are told apart by the unexplained variances, which are known no better than the number of samples lets them.
  const double best = 1.0 - found->correlation * found->correlation;
  const double rival = 1.0 - found->rival * found->rival;
  const double margin = 1.0 + 4.0 / std::sqrt(static_cast<double>(fitted->used));
  constexpr double kLeastUnexplained = 0.005;
  if (found->rival > 0.0 && rival < margin * best + kLeastUnexplained) {
    return fail(fmt::format(
        "the motion repeats itself: offsets of {:.0f} and {:.0f} ms fit alike (correlations {:.3f} and {:.3f}); move "
        "unevenly, or give --largest-offset-s below half of the repetition",
        1e3 * found->offset_s, 1e3 * found->rival_offset_s, std::abs(found->correlation), found->rival));
  }
  SignalOffset result;
  result.offset_s = fitted->offset_s;
  result.deviation_s = fitted->deviation_s;
  result.correlation = found->correlation;
  result.rival = found->rival;
  result.rival_offset_s = found->rival_offset_s;
  result.overlap_s = found->overlap_s;
  result.gain = fitted->gain;
  result.residual_rms = fitted->residual_rms;
  result.used = fitted->used;
  result.discarded = fitted->discarded;
  const auto half = first.begin() + static_cast<std::ptrdiff_t>(first.size() / 2);
  const auto one = fit({first.begin(), half}, second, fitted->offset_s, gap_1, gap_2);
  const auto other = fit({half, first.end()}, second, fitted->offset_s, gap_1, gap_2);
  result.first_half_s = one ? one->offset_s : result.offset_s;
  result.second_half_s = other ? other->offset_s : result.offset_s;
  return result;
}

}  // namespace perimap
