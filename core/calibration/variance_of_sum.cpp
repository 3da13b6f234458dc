#include "core/calibration/variance_of_sum.hpp"

#include <algorithm>
#include <cstddef>

namespace perimap {

double variance_of_sum(const std::vector<double>& values) {
  const std::size_t n = values.size();
  const std::size_t lags = std::min<std::size_t>(100, n / 10);
  double alone = 0.0;
  for (const double value : values) alone += value * value;
  double variance = alone;
  for (std::size_t lag = 1; lag < lags; ++lag) {
    double together = 0.0;
    for (std::size_t i = lag; i < n; ++i) together += values[i] * values[i - lag];
    variance += 2.0 * (1.0 - static_cast<double>(lag) / static_cast<double>(lags)) * together;
  }
  return std::max(variance, 0.5 * alone);  // what falls below is chance
}

}  // namespace perimap
