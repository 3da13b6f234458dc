#include "core/calibration/residual_correlation.hpp"

#include <cmath>
#include <cstddef>

namespace perimap {

double correlation_length(const std::vector<double>& residuals) {
  const std::size_t n = residuals.size();
  if (n < 8) return 1.0;
  double mean = 0.0;
  for (const double r : residuals) mean += r / static_cast<double>(n);
  double variance = 0.0;
  for (const double r : residuals) variance += (r - mean) * (r - mean);
  if (!(variance > 0.0)) return 1.0;
  double length = 1.0;
  const double by_chance = 2.0 / std::sqrt(static_cast<double>(n));
  for (std::size_t lag = 1; lag < n / 3; ++lag) {
    double sum = 0.0;
    for (std::size_t i = lag; i < n; ++i) sum += (residuals[i] - mean) * (residuals[i - lag] - mean);
    if (sum / variance < by_chance) break;
    length += 2.0 * sum / variance;
  }
  return length;
}

}  // namespace perimap
